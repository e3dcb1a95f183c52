#pragma once

#include <string>
#include <vector>

#include "hal/sim/hand/hand.h"
#include "hal/sim/simulated_rig.h"
#include "rt/model/models.h"
#include "rt/scene/scene_spec.h"

namespace hapticd::study {

/// A hand presses and holds; what it feels is read off the truth.
struct PressTask {
  sim::SimulationConfig rig{};
  rt::SceneSpec scene{};
  const rt::ObjectModel* model = nullptr;  ///< of the object, if the scene needs one
  sim::HandProgram hand{};
  double judged_from_s = 2.0;  ///< after the force has been built up
  double judged_to_s = 3.0;

  /// How long the hand takes to build its force up.
  double load_s() const { return 1.875 * hand.force_n / hand.force_rate_n_per_s; }
};

/// One instant of the press.
struct PressPoint {
  double since_s = 0.0;  ///< after the contact began
  double depth_mm = 0.0;
  double hand_force_n = 0.0;
};

/// Collects a press from true samples, whatever rig they come from.
class PressJudge {
 public:
  explicit PressJudge(const PressTask& task)
      : from_s_(task.load_s() + task.judged_from_s), to_s_(task.load_s() + task.judged_to_s) {}
  /// Takes a sample, in the order of time.
  void take(double time_s, const hal::TruthSample& truth);

  bool touched() const noexcept { return touched_s_ >= 0.0; }
  double since_s() const noexcept { return touched() ? time_s_ - touched_s_ : -1.0; }
  bool judging() const noexcept { return since_s() > from_s_; }
  bool over() const noexcept { return since_s() >= to_s_; }

  /// Mean force over mean depth of the time that is judged; 0 before any.
  double rendered_n_per_mm() const noexcept {
    return depth_sum_mm_ > 0.0 ? force_sum_n_ / depth_sum_mm_ : 0.0;
  }
  double swing_mm() const noexcept { return deepest_mm_ - shallowest_mm_; }  ///< peak to peak then
  const std::vector<PressPoint>& points() const noexcept { return points_; }

 private:
  double from_s_;
  double to_s_;
  double time_s_ = 0.0;
  double touched_s_ = -1.0;
  double force_sum_n_ = 0.0;
  double depth_sum_mm_ = 0.0;
  double shallowest_mm_ = 1e9;
  double deepest_mm_ = -1e9;
  std::vector<PressPoint> points_;
};

struct PressOutcome {
  std::string failed;  ///< why there is no figure; empty = there is
  double rendered_n_per_mm = 0.0;
  double swing_mm = 0.0;
  std::vector<PressPoint> points;
};

/// Presses on the simulated rig in virtual time.
PressOutcome press_direct(const PressTask& task);
/// Through the scripted board and its two drivers, in virtual time.
PressOutcome press_on_board(const PressTask& task);

/// What the machine did to a live press between its first contact and its end.
struct Disturbance {
  double longest_tick_gap_ms = 0.0;
  double longest_world_gap_ms = 0.0;  ///< between two of the truths kept, a millisecond apart
  std::uint64_t ticks_missed = 0;
  std::uint64_t ticks = 0;
};

struct LivePress {
  PressOutcome outcome;
  Disturbance disturbance;
  int attempts = 0;  ///< made in all; each but the last was spoilt by a stall
};

inline constexpr double kStallMs = 20.0;

/// Live over box, vendor's library and their drivers; at most three times, if the machine stalled.
LivePress press_emulated(const PressTask& task);

}  // namespace hapticd::study
