#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "hal/rig.h"
#include "rt/record/observation.h"
#include "rt/signal/motion_estimator.h"
#include "rt/signal/tool_load.h"
#include "server/identification/estimate/inclusion/inclusion_fit.h"
#include "server/identification/gate/sample_gate.h"

namespace hapticd::identification {

/// Turns observations into presses: where the surface was met and what came after until the tip was free
/// again. All else (the tool's inertia, noise, a light touch) is left out. Bounded memory: of many presses
/// the oldest are dropped, of a long one every second sample.
class PressCollector {
 public:
  static constexpr std::size_t kMaxPresses = 200;
  static constexpr std::size_t kMaxSamples = 40;  ///< of one press
  static constexpr double kMinDepthMm = 2.0;      ///< of the tip below where it touched
  static constexpr double kMinForceN = 0.1;

  PressCollector(const hal::RigInfo& rig, double threshold_n);

  void add(const rt::Observation& observation);
  /// Ends the data: a press in the middle of which they end counts as well.
  void end();

  /// Presses that are over.
  const std::vector<Press>& presses() const noexcept { return presses_; }
  /// Number of presses that were completed, also those that were dropped since.
  std::size_t completed() const noexcept { return completed_; }
  std::uint64_t samples() const noexcept { return samples_; }
  /// True if the tip was ever seen free: not if the sensor was never biased.
  bool seen_free() const noexcept { return seen_free_; }
  double watched_s() const noexcept { return gate_.watched_s(); }
  /// Presses and ticks that were left out, in words.
  std::vector<std::string> remarks() const;

 private:
  void finish_press();

  SampleGate gate_;
  rt::ThreeAxisMotion motion_;
  rt::ToolLoad load_;
  double threshold_n_;
  std::size_t settling_ticks_;
  std::size_t ticks_since_restart_ = 0;

  Press press_;
  bool touching_ = false;
  std::optional<hal::Vector3> quiet_mm_;  ///< where the force was quiet last
  bool was_free_ = false;  ///< since the start or a gap: only then is it known where a press begins
  double since_s_ = 0.0;   ///< of the press under way
  double kept_s_ = 0.0;    ///< the time of its last kept sample
  double step_s_ = 0.0;    ///< between two samples that are kept
  double below_s_ = 0.0;   ///< how long the force has been below the threshold
  double deepest_mm_ = 0.0, largest_n_ = 0.0;

  std::vector<Press> presses_;
  std::size_t completed_ = 0;
  std::uint64_t samples_ = 0;
  std::size_t touches_ = 0, interrupted_ = 0;
  bool seen_free_ = false;
};

}  // namespace hapticd::identification
