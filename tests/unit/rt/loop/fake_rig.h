#pragma once

#include <functional>

#include "hal/rig.h"

namespace hapticd::rt {

/// A rig for tests of the loop: free tool, scripted misbehaviour, remembers what it was reported.
class FakeRig final : public hal::Rig {
 public:
  explicit FakeRig(bool owns_clock = false) : owns_clock_(owns_clock) {
    info_.name = "fake";
    info_.device = {"fake", 8.5, 1.4, 0.03, 3.5, 75.0};
    info_.sensor = {"fake", 35.0, 0.001, 10000.0, 9.35};
  }
  const hal::RigInfo& info() const noexcept override { return info_; }
  bool owns_clock() const noexcept override { return owns_clock_; }
  void read(hal::RigSample& sample) noexcept override {
    if (before_read) before_read(ticks_);
    sample = hal::RigSample{};
    sample.tick = ticks_;
    sample.time_ns = static_cast<std::int64_t>(ticks_) * 1'000'000;
    sample.force_count = 10;
    ++ticks_;
  }
  void write(const hal::DeviceCommand& command) noexcept override {
    last_command = command;
    ++writes;
  }
  /// Reads a sample for an engine, or what runs one, and returns its command.
  template <class Engine>
  auto tick(Engine& engine) {
    hal::RigSample sample;
    read(sample);
    return engine.on_tick(sample);
  }
  bool exhausted() const noexcept override { return ticks_ >= end_after; }

  std::function<void(std::uint64_t tick)> before_read;
  std::uint64_t end_after = UINT64_MAX;
  hal::DeviceCommand last_command;
  std::uint64_t writes = 0;

 private:
  bool owns_clock_;
  hal::RigInfo info_;
  std::uint64_t ticks_ = 0;
};

}  // namespace hapticd::rt
