#pragma once

#include <cstdio>
#include <cstdlib>

// Builds that look for errors count the locks that each thread holds.
#if !defined(NDEBUG) || defined(HAPTICD_SANITIZED)
#define HAPTICD_COUNTS_LOCKS 1
#else
#define HAPTICD_COUNTS_LOCKS 0
#endif

namespace hapticd {

#if HAPTICD_COUNTS_LOCKS
inline thread_local int held_locks = 0;
inline void note_lock(int change) noexcept {
  held_locks += change;
}
/// Ends the process if the calling thread holds a Mutex.
inline void require_no_lock(const char* what) noexcept {
  if (held_locks == 0) return;
  std::fprintf(stderr, "%s was called under %d locks\n", what, held_locks);
  std::abort();
}
#else
inline void note_lock(int) noexcept {}
inline void require_no_lock(const char*) noexcept {}
#endif

}  // namespace hapticd
