#pragma once

#include <cstdint>
#include <optional>

#include "hal/error.h"
#include "server/identification/gate/sample_gate.h"

namespace hapticd::identification {

/// Range that a palpation spans: enough to see when it cannot be one.
class PalpationExtent {
 public:
  /// Adds every fit sample, in contact or not. `depth_mm` grows into the object, `force_n` is positive when
  /// the object pushes back.
  void add(double depth_mm, double force_n) noexcept;

  std::uint64_t samples() const noexcept { return samples_; }
  double depth_range_mm() const noexcept { return deepest_mm_ - shallowest_mm_; }
  double largest_force_n() const noexcept { return largest_n_; }
  double smallest_force_n() const noexcept { return smallest_n_; }
  double mean_force_n() const noexcept { return mean_n_; }
  double force_range_n() const noexcept { return largest_n_ - smallest_n_; }
  /// Correlation of depth and force.
  double correlation() const noexcept;

 private:
  std::uint64_t samples_ = 0;
  double shallowest_mm_ = 0.0, deepest_mm_ = 0.0, smallest_n_ = 0.0, largest_n_ = 0.0;
  double mean_mm_ = 0.0, mean_n_ = 0.0, sxx_ = 0.0, sxf_ = 0.0, sff_ = 0.0;
};

/// Reason why these data cannot be a palpation, with what to do about it: nothing usable, too little, a
/// constant signal, force or position of the wrong sign, no contact, units that no object has. None if they
/// may be.
std::optional<hal::Error> palpation_refusal(const PalpationExtent& extent, const SampleGate& gate,
                                            double threshold_n, bool recorded);

}  // namespace hapticd::identification
