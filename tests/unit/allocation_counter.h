#pragma once

namespace hapticd::test {

/// How often this program has asked for memory with `new`, on any thread, since its start. Link
/// allocation_counter.cpp into the test that looks.
long allocations() noexcept;

}  // namespace hapticd::test
