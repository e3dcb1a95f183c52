#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <stdexcept>
#include <string>
#include <vector>

#include "hal/rig.h"
#include "server/identification/session/identification.h"
#include "tests/support/texts.h"
#include "tests/support/value_of.h"

namespace hapticd::identification::test {

using hapticd::test::holds;
using hapticd::test::value_of;

/// Estimated parameter of that name. Throws std::out_of_range if there is none.
inline const rt::EstimatedParameter& parameter(const std::vector<rt::EstimatedParameter>& all,
                                               const std::string& name) {
  const auto found = std::ranges::find(all, name, &rt::EstimatedParameter::name);
  if (found == all.end()) throw std::out_of_range("no parameter " + name);
  return *found;
}
inline const rt::EstimatedParameter& parameter(const rt::IdentifiedModel& model, const std::string& name) {
  return parameter(model.parameters, name);
}

inline bool has_remark(const Identification& identification, const std::string& words) {
  const std::vector<std::string> remarks = identification.progress().remarks;
  return std::ranges::any_of(remarks,
                             [&](const std::string& r) { return r.find(words) != std::string::npos; });
}

/// Why nothing was found; a failure of the test if something was.
inline hal::Error refusal_of(const Identification& identification) {
  const auto model = identification.finish();
  EXPECT_FALSE(model) << "was not refused";
  return model ? hal::Error{} : model.error();
}

/// A recording of another rig's make, or of one that does not say which.
inline hal::RigInfo recording_rig(double rate_hz) {
  hal::RigInfo rig;
  rig.kind = hal::RigKind::kReplay;
  rig.rate_hz = rate_hz;
  return rig;
}

}  // namespace hapticd::identification::test
