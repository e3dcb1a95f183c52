#pragma once

#include <cstdint>

#include "hal/samples.h"
#include "hal/sim/device/axis_dynamics.h"
#include "hal/sim/hand/hand.h"
#include "hal/sim/hand/minimum_jerk.h"

namespace hapticd::sim {

/// What the hand is to the tool, along the press direction (z) and across it.
struct HandImpedance {
  double mass_kg = 0.0;
  double stiffness_n_per_mm = 0.0;
  double damping_n_s_per_mm = 0.0;
  double lateral_stiffness_n_per_mm = 0.0;
  double lateral_damping_n_s_per_mm = 0.0;
};

/// The impedance that goes with a program: a hand, a bare mass, or the weak guide of a shaken device.
HandImpedance impedance_of(const HandProgram& program);

/// What the hand perceives.
struct HandPerception {
  hal::Vector3 tip_mm;
  double press_force_n = 0.0;  ///< it exerts, downwards or, following a contour, into the surface
  double reaction_n = 0.0;     ///< of the object; a hand feels the touch
};

/// What the hand means to do right now.
struct HandIntent {
  /// The position is meant relative to the surface: x and y along it, z along its normal, as a hand that
  /// follows a contour feels its way.
  bool follows_contour = false;
  hal::Vector3 position_mm;
  hal::Vector3 velocity_mm_per_s;
  double support_n = 0.0;      ///< upward force on the tool besides the impedance
  hal::Vector3 motor_force_n;  ///< the device is made to give by itself
};

/// A program unfolding in time, reported relative to its place. Bounded work per step, no allocation.
class HandMotion {
 public:
  HandMotion(const HandProgram& program, const hal::Vector3& start_mm) noexcept;
  HandIntent step(double step_s, const HandPerception& perceived) noexcept;
  /// The program has come to its end, and the hand holds the tool still and free. Never where the program
  /// goes on until the next one.
  bool is_over() const noexcept;

 private:
  enum class Phase : std::uint8_t {
    kLift,
    kApproach,
    kLoad,
    kStroke,
    kRetreat,
    kStrike,
    kRebound,
    kReturn,
    kPause,
    kFree
  };

  void enter(Phase phase, const MotionState& to = {}, double duration_s = 0.0) noexcept;
  void leave_phase() noexcept;
  void servo_force(double step_s, double wanted_n, const HandPerception& felt) noexcept;
  void servo_depth(double step_s, double wanted_mm, const HandPerception& felt) noexcept;
  void finish_repetition() noexcept;
  void strike_again() noexcept;
  double tap_height_mm() const noexcept;
  void scan_next() noexcept;
  HandIntent posture(HandIntent intent) const noexcept;
  HandIntent dart(HandIntent intent) const noexcept;
  HandIntent follow(double step_s, const HandPerception& perceived) noexcept;
  double knock_n(double since_s) const noexcept;

  HandProgram program_;
  Phase phase_ = Phase::kLift;
  double time_s_ = 0.0;        ///< since the program began
  double phase_time_s_ = 0.0;  ///< since the phase began
  double cycle_began_s_ = 0.0;
  int done_ = 0;
  int strokes_ = 0;
  double stroking_s_ = 0.0;  ///< since the first stroke began
  MinimumJerk path_;
  MotionState vertical_;
  double slant_ = 0.0;     ///< tap: way aside per height
  double along_mm_ = 0.0;  ///< coordinate along `stroke_direction`
  double along_mm_per_s_ = 0.0;
  double lead_mm_ = 0.0;     ///< by which a stroke's intent runs ahead of its path
  hal::Vector3 follows_mm_;  ///< follow: where the hand is
  hal::Vector3 home_mm_;
  hal::Vector3 aside_mm_;   ///< where it began next to its home
  MinimumJerk homeward_;    ///< share of that which is left
  MinimumJerk along_path_;  ///< scan: to the next place
};

}  // namespace hapticd::sim
