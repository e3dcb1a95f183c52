#pragma once

namespace hapticd::server {

/// Keeps the address space of this process small: stacks of 2 MB for the threads it will start in place of 8,
/// two arenas of the allocator in place of eight for each core, and memory of large blocks given back when
/// they are freed. Call it before there are threads.
void set_memory_budget();

}  // namespace hapticd::server
