#include "server/process/memory_budget.h"

#include <malloc.h>
#include <pthread.h>

#include <cstddef>

namespace hapticd::server {

namespace {

// A sanitizer's frames are several times as large.
#ifdef HAPTICD_SANITIZED
constexpr std::size_t kThreadStackBytes = std::size_t{8} << 20U;
#else
constexpr std::size_t kThreadStackBytes = std::size_t{2} << 20U;
#endif
constexpr int kArenas = 2;
/// Larger blocks are mapped by themselves. Set, it stays: otherwise the allocator raises it to 32 MB and
/// keeps what is freed.
constexpr int kMappedBytes = 256 << 10;

}  // namespace

void set_memory_budget() {
  mallopt(M_ARENA_MAX, kArenas);
  mallopt(M_MMAP_THRESHOLD, kMappedBytes);
  pthread_attr_t attributes;
  if (pthread_attr_init(&attributes) != 0) return;
  if (pthread_attr_setstacksize(&attributes, kThreadStackBytes) == 0) pthread_setattr_default_np(&attributes);
  pthread_attr_destroy(&attributes);
}

}  // namespace hapticd::server
