#include "rt/loop/loop_memory.h"

#include <link.h>
#include <sys/mman.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstdint>
#include <cstring>
#include <string_view>

namespace hapticd::rt {

namespace {

/// True for what a tick calls: the program and the libraries that every C++ program has. A vendor's library
/// of a device is loaded before, and calls more; its name is not known here.
bool is_of_the_tick(std::string_view path) {
  if (path.empty()) return true;  // the program
  const std::string_view name = path.substr(path.rfind('/') + 1);
  for (const std::string_view prefix : {"libc.so", "libm.so", "libstdc++.so", "libgcc_s.so", "libHD.so"}) {
    if (name.starts_with(prefix)) return true;
  }
  return false;
}

/// Locks the segments with their content, not only what of it was touched.
int lock_segments(dl_phdr_info* object, std::size_t, void*) {
  if (!is_of_the_tick(object->dlpi_name != nullptr ? object->dlpi_name : "")) return 0;
  const auto page = static_cast<std::uintptr_t>(sysconf(_SC_PAGESIZE));
  for (int i = 0; i < object->dlpi_phnum; ++i) {
    const ElfW(Phdr)& segment = object->dlpi_phdr[i];
    if (segment.p_type != PT_LOAD) continue;
    const std::uintptr_t begin = (object->dlpi_addr + segment.p_vaddr) & ~(page - 1);
    const std::uintptr_t end = object->dlpi_addr + segment.p_vaddr + segment.p_memsz;
    // A failure only means that a page may come late.
    static_cast<void>(mlock(reinterpret_cast<const void*>(begin), end - begin));
  }
  return 0;
}

}  // namespace

std::string lock_used_memory() {
  if (mlockall(MCL_CURRENT | MCL_FUTURE | MCL_ONFAULT) != 0) return std::strerror(errno);
  dl_iterate_phdr(lock_segments, nullptr);
  return {};
}

void prefault_stack() noexcept {
  std::array<volatile unsigned char, std::size_t{256} * 1024> pages{};
  for (std::size_t i = 0; i < pages.size(); i += 4096) pages[i] = 0;
}

}  // namespace hapticd::rt
