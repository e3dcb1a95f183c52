#pragma once

#include <chrono>
#include <functional>
#include <thread>

namespace hapticd::test {

/// Whether `condition` comes true: looked at every millisecond, for so long that a busy machine fails no test.
inline bool eventually(const std::function<bool()>& condition) {
  for (const auto until = std::chrono::steady_clock::now() + std::chrono::seconds(60);
       std::chrono::steady_clock::now() < until;) {
    if (condition()) return true;
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  return condition();
}

}  // namespace hapticd::test
