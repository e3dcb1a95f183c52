#include "hal/phantom/watchdog.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>

namespace hapticd::phantom {

Watchdog::Watchdog(daq::Board& board, std::size_t outputs, double timeout_ms) noexcept
    : board_(board), outputs_(outputs), timeout_ns_(std::llround(1e6 * timeout_ms)) {}

Watchdog::~Watchdog() {
  stop();
}

void Watchdog::start() {
  stop();
  stopping_ = false;
  armed_.store(false, std::memory_order_relaxed);
  cut_.store(false, std::memory_order_relaxed);
  thread_ = std::thread([this] { run(); });
}

void Watchdog::stop() noexcept {
  {
    const std::lock_guard lock(mutex_);
    stopping_ = true;
  }
  stopped_.notify_all();
  if (thread_.joinable()) thread_.join();
}

void Watchdog::fed(std::int64_t now_ns) noexcept {
  fed_ns_.store(now_ns, std::memory_order_relaxed);
  armed_.store(true, std::memory_order_release);
}

// A command in progress during the cut arms the watchdog again and is cut later.
void Watchdog::run() noexcept {
  constexpr std::array<double, daq::kMaxOutputs> kZero{};
  const std::chrono::nanoseconds poll_interval(std::clamp<std::int64_t>(timeout_ns_ / 4, 500'000, 5'000'000));
  std::unique_lock lock(mutex_);
  while (!stopped_.wait_for(lock, poll_interval, [this] { return stopping_; })) {
    if (!armed_.load(std::memory_order_acquire)) continue;
    if (board_.now_ns() - fed_ns_.load(std::memory_order_relaxed) <= timeout_ns_) continue;
    // Reported before it is done: a command that comes in between is withheld, not cut off after a moment.
    armed_.store(false, std::memory_order_release);
    cut_.store(true, std::memory_order_release);
    cuts_.fetch_add(1, std::memory_order_relaxed);
    const bool done = board_.write_volts(std::span(kZero).first(outputs_));
    if (!done) armed_.store(true, std::memory_order_release);  // tried again until the board accepts it
  }
}

}  // namespace hapticd::phantom
