#pragma once

#include <fcntl.h>
#include <unistd.h>

#include <array>
#include <cstddef>

namespace hapticd::test {

/// A pipe that is full and whose reader does not read: who writes to it waits.
class FullPipe {
 public:
  FullPipe() {
    if (pipe2(ends_.data(), O_CLOEXEC) != 0) return;
    fcntl(ends_[1], F_SETFL, O_NONBLOCK);
    while (write(ends_[1], "x", 1) == 1) {
    }
    fcntl(ends_[1], F_SETFL, 0);
    fcntl(ends_[0], F_SETFL, O_NONBLOCK);
  }
  ~FullPipe() {
    for (const int end : ends_) close(end);
  }
  FullPipe(const FullPipe&) = delete;
  FullPipe& operator=(const FullPipe&) = delete;

  /// End that is written to.
  int in() const { return ends_[1]; }
  /// Reads all that is there; returns how many bytes.
  std::size_t read_all() const {
    std::array<char, 4096> bytes{};
    std::size_t count = 0;
    for (ssize_t n = 0; (n = read(ends_[0], bytes.data(), bytes.size())) > 0;) {
      count += static_cast<std::size_t>(n);
    }
    return count;
  }

 private:
  std::array<int, 2> ends_{-1, -1};
};

}  // namespace hapticd::test
