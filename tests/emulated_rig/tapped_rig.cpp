#include "tests/emulated_rig/tapped_rig.h"

#include "tests/support/system/monotonic_ns.h"

namespace hapticd::test {

TappedRig::TappedRig(hal::Rig& rig, std::function<double()> standing_n)
    : rig_(rig), standing_n_(std::move(standing_n)), series_(kMaxTicks) {}

void TappedRig::after_write(std::function<void()> action) {
  action_ = std::move(action);
  action_state_.store(kWaiting, std::memory_order_release);
}

std::optional<std::uint64_t> TappedRig::done_after() const noexcept {
  if (action_state_.load(std::memory_order_acquire) != kDone) return std::nullopt;
  return done_after_.load(std::memory_order_relaxed);
}

void TappedRig::read(hal::RigSample& sample) noexcept {
  const std::size_t count = marks_.load(std::memory_order_relaxed);
  if (count < series_.size()) {
    series_[count] = {monotonic_ns(), standing_n_ ? standing_n_() : 0.0};
    marks_.store(count + 1, std::memory_order_release);
  }
  rig_.read(sample);
  if (change_) change_(sample);
  tick_ = sample.tick;
}

void TappedRig::write(const hal::DeviceCommand& command) noexcept {
  rig_.write(command);
  if (action_state_.load(std::memory_order_acquire) != kWaiting) return;
  action_();
  done_after_.store(tick_, std::memory_order_relaxed);
  action_state_.store(kDone, std::memory_order_release);
}

}  // namespace hapticd::test
