#pragma once

#include <optional>

#include "hal/samples.h"
#include "rt/friction/friction_model.h"
#include "rt/signal/butterworth_low_pass.h"

namespace hapticd::rt {

/// Deformation direction as the dissertation finds it: the sliding direction from the last two positions
/// (4.17)-(4.19), friction along it from (4.11) or (4.15) with the normal of the tick before (4.20), the rest
/// of the reaction is normal (4.10), through a 70 Hz Butterworth filter. If the friction was identified as
/// Maxwell-slip, its elements replace (4.15).
class PublishedDirection {
 public:
  static constexpr double kCutoffHz = 70.0;

  PublishedDirection(FrictionLaw law, const FrictionParameters& friction, double rate_hz) noexcept;

  /// Starts a contact. Without a direction to start from, the whole reaction counts as normal.
  void begin(const hal::Vector3& reaction_n) noexcept;
  /// Takes, in the rig frame, the reaction on the tool, the motion of the tip since the last tick, `periods`
  /// ago, and its velocity.
  void update(const hal::Vector3& reaction_n, const hal::Vector3& step_mm,
              const hal::Vector3& velocity_mm_per_s, double periods = 1.0) noexcept;

  /// u^n, out of the object, length 1.
  const hal::Vector3& normal() const noexcept { return normal_; }
  /// Friction on the tool (4.16).
  const hal::Vector3& friction_n() const noexcept { return friction_n_; }

 private:
  FrictionLaw law_;
  FrictionParameters friction_;
  BasicButterworthLowPass<hal::Vector3> filter_;
  hal::Vector3 normal_{0.0, 0.0, 1.0};
  hal::Vector3 tangent_;  ///< u^t; zero until something slid
  double built_up_ = 0.0;
  std::optional<PlanarMaxwellSlip> maxwell_slip_;
  hal::Vector3 friction_n_;
};

}  // namespace hapticd::rt
