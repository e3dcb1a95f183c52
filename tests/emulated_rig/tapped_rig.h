#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "hal/rig.h"

namespace hapticd::test {

/// What is noted at the begin of a tick, before anything is read.
struct TickMark {
  std::int64_t monotonic_ns = 0;  ///< CLOCK_MONOTONIC
  double standing_n = 0.0;  ///< force at the device itself, magnitude: what the ticks before have left there
};

/// A rig as it is, but for what a test wants to know of its ticks and to do between them.
class TappedRig final : public hal::Rig {
 public:
  static constexpr std::size_t kMaxTicks = 400'000;

  /// `standing_n` is asked at the begin of every tick, on the clock's thread.
  TappedRig(hal::Rig& rig, std::function<double()> standing_n);

  /// Done once, on the clock's thread, after the next write.
  void after_write(std::function<void()> action);
  /// The tick after whose write it was done; none yet.
  std::optional<std::uint64_t> done_after() const noexcept;
  /// Done to every sample before it is handed on; before the clock runs.
  void change_samples(std::function<void(hal::RigSample&)> change) { change_ = std::move(change); }

  /// Number of ticks begun so far, each at the place of its number.
  std::size_t marks() const noexcept { return marks_.load(std::memory_order_acquire); }
  const TickMark& mark(std::size_t tick) const { return series_[tick]; }

  const hal::RigInfo& info() const noexcept override { return rig_.info(); }
  bool owns_clock() const noexcept override { return false; }
  hal::ServoClock* clock() noexcept override { return rig_.clock(); }
  std::optional<hal::Error> engage(hal::RigPartKind part) override { return rig_.engage(part); }
  void disengage(hal::RigPartKind part) noexcept override { rig_.disengage(part); }
  std::vector<hal::PartReport> reports() const override { return rig_.reports(); }
  std::optional<hal::Error> bias_force_sensor() override { return rig_.bias_force_sensor(); }
  std::optional<hal::Error> home_device() override { return rig_.home_device(); }
  bool external_position(hal::Vector3& position_mm) const noexcept override {
    return rig_.external_position(position_mm);
  }
  void read(hal::RigSample& sample) noexcept override;
  void write(const hal::DeviceCommand& command) noexcept override;

 private:
  enum Deed : int { kNone, kWaiting, kDone };

  hal::Rig& rig_;
  const std::function<double()> standing_n_;
  std::function<void(hal::RigSample&)> change_;
  std::vector<TickMark> series_;
  std::atomic<std::size_t> marks_{0};
  std::uint64_t tick_ = 0;
  std::function<void()> action_;
  std::atomic<int> action_state_{kNone};
  std::atomic<std::uint64_t> done_after_{0};
};

}  // namespace hapticd::test
