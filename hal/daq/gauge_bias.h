#pragma once

#include <array>
#include <cstddef>
#include <optional>

#include "hal/daq/calibration.h"

namespace hapticd::daq {

/// Gauge readings over slightly more than the last 0.25 s, so that a bias can be taken at any time without
/// waiting. Keeps sums over tenths of that time: bounded work, no single scans.
class GaugeBias {
 public:
  using Volts = std::array<double, kGauges>;
  static constexpr double kWindowS = 0.25;

  explicit GaugeBias(double scan_rate_hz) noexcept
      : block_scans_(static_cast<std::size_t>(scan_rate_hz * kWindowS / static_cast<double>(kBlocks)) + 1) {}

  void add(const Volts& volts) noexcept {
    Block& block = blocks_[newest_];
    for (std::size_t j = 0; j < kGauges; ++j) block.sum_v[j] += volts[j];
    if (++block.count < block_scans_) return;
    newest_ = (newest_ + 1) % blocks_.size();
    blocks_[newest_] = {};
    if (complete_ < kBlocks) ++complete_;
  }

  /// Forgets all readings, after a gap in the acquisition.
  void restart() noexcept {
    blocks_ = {};
    complete_ = 0;
  }

  /// Mean, V; nothing until the window is full.
  std::optional<Volts> mean_v() const noexcept {
    if (complete_ < kBlocks) return std::nullopt;
    Volts mean{};
    std::size_t count = 0;
    for (const Block& block : blocks_) {
      for (std::size_t j = 0; j < kGauges; ++j) mean[j] += block.sum_v[j];
      count += block.count;
    }
    for (double& v : mean) v /= static_cast<double>(count);
    return mean;
  }

 private:
  static constexpr std::size_t kBlocks = 10;
  struct Block {
    Volts sum_v{};
    std::size_t count = 0;
  };

  std::size_t block_scans_;
  std::array<Block, kBlocks + 1> blocks_{};  ///< the newest is being filled
  std::size_t newest_ = 0;
  std::size_t complete_ = 0;
};

}  // namespace hapticd::daq
