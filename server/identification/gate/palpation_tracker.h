#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "hal/rig.h"
#include "hal/samples.h"
#include "rt/contact/contact_detector.h"
#include "rt/contact/contact_onset.h"
#include "rt/contact/free_motion_residual.h"
#include "rt/signal/motion_estimator.h"
#include "server/identification/gate/palpation_sample.h"

namespace hapticd::identification {

/// Turns the samples of a live rig into those of a palpation along its press axis (-z, tool upright): contact
/// by what free motion leaves behind (D§3.2), displacement from where the rested object was touched first,
/// the tool's inertia is subtracted from the force (3.4). A sample in, a sample out, in constant time.
class PalpationTracker {
 public:
  /// Makes a tracker. `tool_mass_g`: beyond the sensor; `threshold_n`: ε_f.
  PalpationTracker(double tool_mass_g, double threshold_n, double position_resolution_mm,
                   double rate_hz) noexcept;

  PalpationSample update(const hal::RigSample& sample) noexcept;
  /// Restarts after a gap: velocities and filters start again, the surface stays where it was found and the
  /// tool in or out of contact. What the next ticks give is distinguished by settled().
  void restart() noexcept;

  /// False for a while after a restart: velocity and inertia are not known yet.
  bool settled() const noexcept { return ticks_since_restart_ > settling_ticks_; }
  bool touched() const noexcept { return touched_; }
  double surface_mm() const noexcept { return surface_mm_; }
  std::uint32_t contacts() const noexcept { return contact_.count(); }

 private:
  double tool_mass_g_;
  double threshold_n_;
  rt::ContactDetector contact_;
  rt::FreeMotionResidual residual_;
  rt::ContactOnset onset_;
  rt::MotionEstimator motion_;
  double surface_mm_ = 0.0;
  bool touched_ = false;
  std::uint32_t settling_ticks_;
  std::uint32_t ticks_since_restart_;
};

/// Turns a recording into samples of a palpation: steps may be uneven and long (10 Hz), there is no tool
/// whose inertia matters, and the surface is unknown; displacement is the recording's own position, and
/// contact is force above the threshold. The velocity is the slope of a local parabola over true times, by
/// least squares, centred on the sample: each comes out half a window late, and none across a gap.
class RecordedPalpation {
 public:
  /// Makes a palpation. `rate_hz`: one over the median step.
  RecordedPalpation(double threshold_n, double rate_hz) noexcept;

  /// True if a sample came out.
  bool update(const hal::RigSample& sample, PalpationSample& out) noexcept;
  void restart() noexcept { filled_ = 0; }
  std::uint32_t contacts() const noexcept { return contacts_; }

 private:
  static constexpr std::size_t kMax = 21;
  struct Moment {
    double time_s, depth_mm, force_n;
  };
  double slope_at_centre() const noexcept;

  double threshold_n_;
  std::size_t window_;  ///< samples, odd
  std::array<Moment, kMax> ring_{};
  std::size_t newest_ = 0;
  std::size_t filled_ = 0;
  bool in_contact_ = false;
  std::uint32_t contacts_ = 0;
};

}  // namespace hapticd::identification
