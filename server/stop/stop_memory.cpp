#include "server/stop/stop_memory.h"

#include <openssl/crypto.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdlib>
#include <cstring>
#include <memory_resource>
#include <new>

#include "hal/lock/mutex.h"

namespace hapticd::server {

namespace {

/// Memory for kMaxConnections connections of some 50 kB; only what is used takes memory.
constexpr std::size_t kPoolBytes = std::size_t{6} << 20U;
constexpr std::size_t kLargestBlock = std::size_t{64} << 10U;

/// Header before each block: what has to be known to give it back.
struct alignas(std::max_align_t) Header {
  std::size_t size;
  bool is_of_pool;
};

class Pool {
 public:
  void* allocate(std::size_t size) {
    const MutexLock lock(mutex_);
    return blocks_.allocate(aligned(size), alignof(std::max_align_t));
  }
  void release(void* block, std::size_t size) {
    const MutexLock lock(mutex_);  // also of other threads, for what they give back of it
    blocks_.deallocate(block, aligned(size), alignof(std::max_align_t));
  }

 private:
  /// libstdc++ keeps blocks of 24 bytes one after the other, whatever alignment is asked for.
  static constexpr std::size_t aligned(std::size_t size) {
    constexpr std::size_t kAlignment = alignof(std::max_align_t);
    return (size + kAlignment - 1) / kAlignment * kAlignment;
  }

  std::array<std::byte, kPoolBytes> bytes_;
  Mutex mutex_;
  std::pmr::monotonic_buffer_resource source_{bytes_.data(), bytes_.size(), std::pmr::new_delete_resource()};
  std::pmr::unsynchronized_pool_resource blocks_ GUARDED_BY(mutex_){{0, kLargestBlock}, &source_};
};

Pool& pool() {
  static Pool* const the_pool = new Pool;  // OpenSSL gives back until the very end
  return *the_pool;
}

thread_local bool uses_pool = false;

void* take(std::size_t size, const char*, int) {
  if (size == 0) return nullptr;
  const std::size_t whole = size + sizeof(Header);
  void* block = nullptr;
  try {
    block = uses_pool ? pool().allocate(whole) : std::malloc(whole);
  } catch (const std::bad_alloc&) {
    return nullptr;
  }
  if (block == nullptr) return nullptr;
  auto* header = new (block) Header{size, uses_pool};
  return header + 1;
}

void give_back(void* bytes, const char*, int) {
  if (bytes == nullptr) return;
  Header* header = static_cast<Header*>(bytes) - 1;
  if (header->is_of_pool) {
    pool().release(header, header->size + sizeof(Header));
  } else {
    std::free(header);
  }
}

void* take_again(void* bytes, std::size_t size, const char* file, int line) {
  if (bytes == nullptr) return take(size, file, line);
  if (size == 0) {
    give_back(bytes, file, line);
    return nullptr;
  }
  void* moved = take(size, file, line);
  if (moved == nullptr) return nullptr;
  std::memcpy(moved, bytes, std::min(size, (static_cast<Header*>(bytes) - 1)->size));
  give_back(bytes, file, line);
  return moved;
}

bool is_separate = false;

/// Separates the memory. OpenSSL takes memory as soon as it is loaded, and from then on keeps to the
/// functions that it has.
void separate() noexcept {
  is_separate = CRYPTO_set_mem_functions(take, take_again, give_back) == 1;
}

/// Called by the dynamic loader before libraries begin, and so before libssl takes its first memory.
[[gnu::used, gnu::section(".preinit_array")]] void (*const separate_first)() = separate;

}  // namespace

bool has_separate_stop_memory() noexcept {
  return is_separate;
}

void use_stop_memory() noexcept {
  uses_pool = true;
}

}  // namespace hapticd::server
