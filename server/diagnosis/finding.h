#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace hapticd::server {

enum class FindingSeverity : std::uint8_t {
  kGood,
  kNote,     ///< for information; nothing to do
  kWarning,  ///< works, but worse than it could
  kProblem,  ///< does not work
};

/// One result of the doctor.
struct Finding {
  FindingSeverity severity = FindingSeverity::kGood;
  std::string topic;  ///< "kernel", "loop", "force sensor" …
  std::string text;
  std::string remedy;  ///< empty if there is nothing to do
};

using Findings = std::vector<Finding>;

}  // namespace hapticd::server
