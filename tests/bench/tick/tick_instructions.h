#pragma once

#include <optional>
#include <string>

namespace hapticd::bench {

struct InstructionCount {
  std::optional<double> per_tick;
  std::string failed;  ///< why there is none, with the remedy
};

/// Instructions of one tick, as callgrind counts them: the difference between runs of N and of 2 N ticks, so
/// that the start of the program cancels. The same on every machine with the same binary.
InstructionCount count_instructions(const std::string& scene);

}  // namespace hapticd::bench
