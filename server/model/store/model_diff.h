#pragma once

#include <optional>
#include <string>
#include <vector>

#include "server/model/store/model_store.h"

namespace hapticd::server {

/// One parameter of two models; absent if one has none of that name.
struct ParameterDifference {
  std::string name;
  std::string unit;
  std::optional<double> value_a;
  std::optional<double> value_b;
  std::optional<double> relative;    ///< (b - a) / a; none if a is zero
  std::optional<double> deviations;  ///< |b - a| over the root of the sum of squared standard errors; none
                                     ///< if that is unknown or infinite
};

struct ModelDifference {
  std::vector<ParameterDifference> parameters;  ///< in the order of a, then those that only b has
  std::vector<std::string> remarks;             ///< other differences, as text
};

/// kInvalidArgument for models of different kinds.
Outcome<ModelDifference> difference(const StoredModel& a, const StoredModel& b);

}  // namespace hapticd::server
