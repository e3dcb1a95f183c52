#pragma once

#include <string>
#include <vector>

namespace hapticd::cli {

struct Range {
  double low = 0.0;
  double high = 1.0;
};

struct Tick {
  double value = 0.0;
  std::string label;
};

/// Round values (steps of 1, 2 or 5 × 10ⁿ) inside the range, at most `max_count` of them; two at least, if
/// it takes one or two more than that for them to be round.
std::vector<Tick> ticks(const Range& range, int max_count);

/// The range widened to round ends, so that a live plot's axis moves in steps rather than with every sample.
/// A range of no extent (or not finite) is given some.
Range rounded(const Range& range);

/// Smallest range that holds both.
Range united(const Range& a, const Range& b);

}  // namespace hapticd::cli
