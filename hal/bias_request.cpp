#include "hal/bias_request.h"

#include <thread>

namespace hapticd::hal {

namespace {
constexpr std::chrono::milliseconds kPollInterval{1};
}

std::uint64_t BiasRequest::ask() noexcept {
  const std::uint64_t number = last_.fetch_add(1, std::memory_order_relaxed) + 1;
  std::uint64_t none = 0;
  return wanted_.compare_exchange_strong(none, number, std::memory_order_acq_rel) ? number : 0;
}

bool BiasRequest::await(std::uint64_t number, std::chrono::milliseconds timeout) noexcept {
  const auto deadline = std::chrono::steady_clock::now() + timeout;
  while (!is_taken(number)) {
    if (std::chrono::steady_clock::now() >= deadline && claim(number)) return false;
    // Claimed by the reader at the last moment: it is taken at once.
    std::this_thread::sleep_for(kPollInterval);
  }
  return true;
}

}  // namespace hapticd::hal
