#pragma once

#include <array>
#include <cstdint>

#include "hal/samples.h"
#include "hal/sim/base/conditions.h"
#include "hal/sim/base/random.h"

namespace hapticd::sim {

/// What lies between the load on the sensor and an ideal reading of it: cross-talk, a zero that drifts and
/// jumps, a bias taken under load. Has its own random stream.
class SensorZero {
 public:
  SensorZero(const Conditions& conditions, std::uint64_t seed, double step_s) noexcept;

  /// True if there is anything to do.
  bool active() const noexcept { return active_; }
  /// Reading of a load, without the zero's movement; also what a bias takes away.
  hal::Vector3 crossed(const hal::Vector3& load_n) const noexcept;
  /// Advances by one sample: the zero moves on.
  void advance() noexcept;
  /// Error of every reading now.
  const hal::Vector3& offset_n() const noexcept { return offset_n_; }

 private:
  Conditions conditions_;
  Random random_;
  double step_s_;
  bool active_;
  std::array<double, 9> mixing_{};      ///< row by row; of ones without cross-talk
  std::array<double, 3> drift_sign_{};  ///< which way each axis drifts now
  std::array<double, 3> drift_n_{};
  std::array<double, 3> jumped_n_{};
  int jumped_axis_ = -1;  ///< the one that is off; -1 = none
  double until_jump_s_;
  hal::Vector3 offset_n_;
};

}  // namespace hapticd::sim
