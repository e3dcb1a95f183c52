#pragma once

#include <optional>
#include <string>
#include <vector>

#include "hal/rig.h"
#include "hal/samples.h"
#include "rt/contact/contact_detector.h"
#include "rt/contact/contact_onset.h"
#include "rt/contact/free_motion_residual.h"
#include "rt/signal/tool_load.h"
#include "server/identification/estimate/contact/surface_spline.h"

namespace hapticd::identification {

/// Normal in the plane of a line (x of the rig) and up.
struct ScannedNormal {
  hal::Vector3 direction{0.0, 0.0, 1.0};  ///< out of the object, length 1, rig frame
  double error_rad = 0.0;                 ///< standard error
};

/// Surface along a line from light taps (D§4.4.1): each gives the point where it began; a smoothing spline
/// through the points gives the normal. Only contacts that stayed light and in place count, and only on an
/// object that had time to recover: a soft one keeps the mark of a stroke for seconds. Cheap per sample,
/// bounded: at most kMaxTouches points; those that are closest together are dropped.
class SurfaceScan {
 public:
  static constexpr std::size_t kMaxTouches = 128;
  static constexpr double kLightN = 1.0;      ///< a tap presses no harder,
  static constexpr double kInPlaceMm = 1.5;   ///< does not slide farther along
  static constexpr double kMinTapS = 0.02;    ///< and is not a jolt of the tool
  static constexpr double kRecoveryS = 10.0;  ///< after a contact that was not light

  /// `threshold_n`: ε_f of the contact detection.
  SurfaceScan(double threshold_n, const hal::RigInfo& rig);

  /// Adds a fit sample. Returns whether the tip is in contact.
  bool add(const hal::RigSample& sample);
  /// Restarts after a gap: what was going on is unknown.
  void restart();

  bool in_contact() const { return contact_.in_contact(); }
  const std::vector<ProfilePoint>& touches() const { return touches_; }
  std::uint64_t touched() const { return touched_; }  ///< touches ever, also those that made room

  /// The surface through the touches so far; fails like SurfaceSpline::fit().
  hal::Result<SurfaceSpline> surface() const;

 private:
  void follow(const hal::Vector3& force_n, const hal::Vector3& tip_mm, double now_s);
  void release(double now_s);
  void touch(const hal::Vector3& place_mm);

  double threshold_n_;
  double min_error_mm_;
  rt::ToolLoad load_;
  rt::BasicFreeMotionResidual<hal::Vector3> residual_;
  rt::ContactDetector contact_;
  rt::ContactOnset3 onset_;
  double contact_depth_mm_ = 0.0;
  bool touching_ = false;
  hal::Vector3 place_mm_;  ///< of the contact under way
  double began_s_ = 0.0;
  double hardest_n_ = 0.0;
  double aside_mm_ = 0.0;
  double recovered_s_ = 0.0;  ///< when the object will be rested
  std::vector<ProfilePoint> touches_;
  std::uint64_t touched_ = 0;
};

/// Normal that a tip at `tip_mm`, pressed in or not, meets: at the nearest point of the profile (D§4.4.1).
/// None farther than 2 mm beyond the ends of the scan.
std::optional<ScannedNormal> normal_at(const SurfaceSpline& surface, const hal::Vector3& tip_mm);

}  // namespace hapticd::identification
