#pragma once

#include <optional>
#include <string>

#include "hal/error.h"

namespace hapticd::rt {

/// What the real friction of a rod is to feel like: one of the two.
struct FrictionTarget {
  std::optional<double> scale;        ///< of the real tangential force; 1 = as it is
  std::optional<double> coefficient;  ///< at the hand: tangential over normal force while sliding
};

/// Checks that one of the two is set, and in range: scale 0.15 … 3, coefficient 0.02 … 3. The error names the
/// key, after `prefix`.
std::optional<hal::Error> check(const FrictionTarget& target, const std::string& prefix,
                                const std::string& where);

}  // namespace hapticd::rt
