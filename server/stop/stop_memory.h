#pragma once

namespace hapticd::server {

/// True if OpenSSL takes its memory, in threads that say so, from a pool that gRPC's threads do not use: a
/// thread that is not scheduled while it holds a lock of the allocator must not keep a stop waiting. It does
/// in each program that calls this, unless OpenSSL had begun before the program's own first code.
bool has_separate_stop_memory() noexcept;

/// Makes this thread serve stops: what OpenSSL allocates for it comes from that pool from now on.
void use_stop_memory() noexcept;

}  // namespace hapticd::server
