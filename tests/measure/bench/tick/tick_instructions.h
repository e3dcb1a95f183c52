#pragma once

#include <optional>
#include <string>

#include "tests/measure/bench/tick/tick_workload.h"

namespace hapticd::bench {

struct InstructionCount {
  std::optional<double> per_tick;
  std::string failed;  ///< why there is none, with the remedy
};

/// Instructions of one tick, as callgrind counts them inside run_counted(). The same on every machine with
/// the same binary.
InstructionCount count_instructions(const std::string& scene, Extent extent = Extent::kComposed);

/// What is counted: so many ticks and nothing else. Named for callgrind to find.
void run_counted(TickWorkload& workload, long ticks) noexcept;

}  // namespace hapticd::bench
