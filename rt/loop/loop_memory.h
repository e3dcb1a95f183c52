#pragma once

#include <cstddef>
#include <string>

namespace hapticd::rt {

/// Keeps every page that the process has touched, or will touch, in RAM. A page counts from its first use on:
/// unused address space (the rest of stacks, reserves of the allocator) takes no memory. What a tick may
/// execute for the first time is touched at once: the program itself and the C and C++ libraries. Returns why
/// it did not work; empty if it did.
std::string lock_used_memory();

/// Touches the stack the calling thread will use, so that no page of it is first met inside a tick.
void prefault_stack() noexcept;

}  // namespace hapticd::rt
