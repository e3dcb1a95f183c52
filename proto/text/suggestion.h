#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace hapticd::text {

/// The candidate that a mistyped word most probably means; empty when none is near. A word may also be near
/// the beginning of a candidate, so that "stifness" finds "stiffness_n_per_mm".
std::string nearest(std::string_view word, const std::vector<std::string>& candidates);

/// "did you mean 'x'?", or the remedy given when nothing is near.
std::string did_you_mean(std::string_view word, const std::vector<std::string>& candidates,
                         std::string_view otherwise);

/// "a, b, c".
std::string comma_separated(const std::vector<std::string>& words);

}  // namespace hapticd::text
