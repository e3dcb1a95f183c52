#include "hal/phantom/watchdog.h"

#include <pthread.h>

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
  {
    const MutexLock lock(mutex_);
    stopping_ = false;
  }
  armed_.store(false, std::memory_order_relaxed);
  cut_.store(false, std::memory_order_relaxed);
  thread_ = std::thread([this] { run(); });
}

void Watchdog::stop() noexcept {
  {
    const MutexLock lock(mutex_);
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
  pthread_setname_np(pthread_self(), "phantom-cut");
  const std::chrono::nanoseconds poll_interval(std::clamp<std::int64_t>(timeout_ns_ / 4, 500'000, 5'000'000));
  MutexLock lock(mutex_);
  for (;;) {
    const auto due = std::chrono::steady_clock::now() + poll_interval;
    while (!stopping_ && stopped_.wait_until(mutex_, due)) {
    }
    if (stopping_) return;
    lock.unlock();
    cut_if_late();
    lock.lock();
  }
}

void Watchdog::cut_if_late() noexcept {
  constexpr std::array<double, daq::kMaxOutputs> kZero{};
  if (!armed_.load(std::memory_order_acquire)) return;
  if (board_.now_ns() - fed_ns_.load(std::memory_order_relaxed) <= timeout_ns_) return;
  // Reported before it is done: a command that comes in between is withheld, not cut off after a moment.
  armed_.store(false, std::memory_order_release);
  cut_.store(true, std::memory_order_release);
  cuts_.fetch_add(1, std::memory_order_relaxed);
  const bool done = board_.write_volts(std::span(kZero).first(outputs_));
  if (!done) armed_.store(true, std::memory_order_release);  // tried again until the board accepts it
}

}  // namespace hapticd::phantom
