#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "hal/samples.h"
#include "rt/signal/butterworth_low_pass.h"

namespace hapticd::identification {

/// Effect of gravity and motion on a gram of the tool at one moment, next to what the sensor reads, all
/// passed through the same low-pass filter. In the tool's frame
///   f = m (w - B r),  w = Tᵀ(g - a),  B = [α]ₓ + [ω]ₓ²                                   (4.5)-(4.8)
/// with a of the tip and r from the tip to the mass's centre; B is not in the dissertation, whose tool turns
/// slowly enough.
struct ToolExcitation {
  hal::Vector3 weight_n_per_g;                     ///< w
  std::array<hal::Vector3, 3> turning_n_per_g_mm;  ///< rows of B
  hal::Vector3 force_n;                            ///< raw, sensor frame
  hal::Vector3 torque_n_mm;
  hal::Vector3 gravity_in_tool;  ///< unit vector, unfiltered
  double turning_rad_per_s2 = 0.0;
};

/// Filter that makes them from samples. Differences are central, so that what is derived belongs to the
/// middle of a window of 32 ms; force and torque are taken from there too.
class ToolExcitationFilter {
 public:
  /// Makes a filter. `force_is_mean`: the sensor's value is the mean since the tick before (as on a rig), not
  /// a momentary one (as in most recordings).
  ToolExcitationFilter(double rate_hz, bool force_is_mean);

  /// Takes a sample. Nothing until window and filters have settled. Samples follow each other (SampleGate);
  /// after a gap, call reset() first.
  std::optional<ToolExcitation> update(const hal::RigSample& sample);
  void reset() noexcept { count_ = 0; }
  double cutoff_hz() const noexcept { return cutoff_hz_; }

  static constexpr double kCutoffHz = 6.0;  ///< a hand's voluntary motion stays below

 private:
  double rate_hz_;
  bool force_is_mean_;
  double cutoff_hz_;
  std::size_t reach_;  ///< ticks from the middle of the window to its end
  std::vector<hal::RigSample> window_;
  std::size_t next_ = 0;
  std::size_t count_ = 0;
  std::size_t settled_ = 0;  ///< ticks filtered since the start or the last gap
  static constexpr std::size_t kChannels = 6;
  std::vector<rt::BasicButterworthLowPass<hal::Vector3>> first_, second_;
};

}  // namespace hapticd::identification
