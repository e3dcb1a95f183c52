#pragma once

#include "hal/rig.h"

namespace hapticd::test {

/// A rig that measures nothing and takes every command: for those who make the ticks by hand.
class StillRig final : public hal::Rig {
 public:
  const hal::RigInfo& info() const noexcept override { return info_; }
  bool owns_clock() const noexcept override { return true; }
  void read(hal::RigSample& sample) noexcept override { sample = {}; }
  void write(const hal::DeviceCommand&) noexcept override {}

 private:
  hal::RigInfo info_;
};

}  // namespace hapticd::test
