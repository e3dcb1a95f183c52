#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>

#include "hal/samples.h"
#include "rt/signal/drift_tracker.h"
#include "rt/signal/reading_noise.h"
#include "rt/signal/stiffness_fit.h"
#include "rt/signal/vector.h"

namespace hapticd::rt {

/// What the load watch needs to know of the tool.
struct LoadMonitorParameters {
  double tool_mass_g = 0.0;          ///< beyond the sensor; its weight and inertia are not counted as a load
  hal::Quaternion sensor_to_tool{};  ///< rotates sensor coordinates into the tool's; length 1
  /// What the sensor's zero contains of the tool's weight, sensor frame.
  hal::Vector3 weight_in_zero_n{};
  bool knows_weight_in_zero = false;  ///< false: that of the orientation in which it is read first
  double mass_error_g = 0.0;          ///< by which the tool may be heavier or lighter: its inertia is not counted as a load
  double compliance_mm_per_n = 0.0;   ///< of the device behind its encoders; 0: rigid
};

/// Whether the force sensor bears a load, by its raw reading and the encoders alone: no stage, gain, law or
/// scene takes part. Two facts hold of every real object and of nothing else, and are all that is used:
///
/// - **Its reaction changes with the motion.** A reading that steps within two samples and then goes on as
///   before is a jump of the zero: another client's bias, a gauge, a cable. A reading that stays what it is
///   while the tip recedes along it by kRecedeMm is a wrong zero: an object that is left lets go (one as soft
///   as 0.0125 N/mm is still distinguished).
/// - **It is there only where the sensor reads more than its zero, the tool's weight and its inertia.**
///
/// A reading that comes back to what was proven before is free at once, where the tip moves.
///
/// The zero has two parts. jump_n(): what jumped, a bias under load among it; the renderer takes it off every
/// sample before a pipeline sees it. The rest is this watch's own: the reading with which it began, and the
/// sensor's drift since.
///
/// All sizes are of slots of a millisecond (a tick where that is longer):
///
///   step        |s| ≥ kStepN (kLoadedStepN under load; more on a sensor whose noise is beyond 6 mN), s the
///               offset between the straight lines through kBefore slots before and kAfter slots after two
///               slots; both fit within kFlatShare |s|, with the same slope, and the reading itself has
///               changed by most of it between them. It does not
///               count if nothing is read any more afterwards, except under load, where it is noted: then a load
///               has gone, or a jump has hidden it; nor, under load, between slots one of which is more than twice as
///               long as the others.
///   noted       a step under load: a knock on what is held, or a jump. It takes nothing away there, for there
///               is something to press. As long as nothing but that step is read any more, the reading shows no
///               load; once the tip moves meanwhile, it was a jump, and the object has been left. A step back
///               withdraws it, and so does a reading of nothing for 0.25 s of motion.
///   unsure      from the second noted step or jump since the zero was proven until it is proven again, or nothing is
///               read over kProofMm of motion: what is left of several steps may be anything. A step back within
///               kKnockS was a knock, and neither of the two counts.
///   swing       what is read while the tool's mass may swing behind the encoders: the forces of late, the device's
///               and the object's, may make it show more than kLoadN. A reading that begins then, turns by more than 60°
///               within some 10 ms or falls to kDipShare of what it was, is a load only once it has lasted longer than
///               half a swing.
///   suspected   from the first slot that changes by kStepN until the reading has risen three times running,
///               as that of a contact does, or the step is confirmed or refuted: 6 slots at most.
///   waiting     after a jump and after a bias: the zero is not proven before the reading has stayed what it
///               is over kProofMm of motion. Until then no reading counts.
///               After a jump from a proven zero a reading that grows with the way ends it, too
///               (StiffnessFit): that is an object, whether the step was a jump or the stop of the hand that
///               presses. Which of them it was shows afterwards.
///   load        |r| > kLoadN, and the mean of r + m a over 12 slots, along r, > kLoadN + kMassError m |a|,
///               with the largest |a| of late; and more by the error of the mass, and by what the device's
///               own force, which bends it behind its encoders, may have moved the tool's mass. The second
///               difference of the positions over 6 slots is the mean acceleration under the same triangle.
///               A mean that points elsewhere is what was, not what is.
///               |r| > kLoadN + m kUnseenMmPerS2 is one at once.
///   held        what is left of a load, kHeldShare of it at least, is one as long as the tip stays within kHeldMm of
///               where it was seen last and the tool's inertia of late is below kLoadN: an object far softer than its
///               target bears little of what is felt, and relaxes.
///
/// The zero is followed below kLoadN and drifts on under a load as it did before (DriftTracker); one that has just
/// been taken over, in motion, is followed within half a second. A step with which the tip loses half of its speed
/// is an impact. NaN never gets here: such samples are unfit. After an unfit sample or a gap the slots start again
/// and the zero is kept. All state is bounded: nothing grows with time.
class LoadMonitor {
 public:
  static constexpr double kLoadN = 0.05;
  static constexpr double kStepN = 0.05;
  static constexpr double kLoadedStepN = 0.075;
  static constexpr double kRecedeMm = 2.0;
  static constexpr double kProofMm = 3.0;
  static constexpr double kMaxJumpN = 6.0;      ///< a larger one is not taken over as a zero
  static constexpr double kFreeAirS = 0.014;    ///< so long without a load the tool is in free air

  /// Another tool changes what its weight reads as, not the zero; with the same tool nothing is forgotten.
  void set_parameters(const LoadMonitorParameters& parameters) noexcept;
  /// One fit sample, `interval_s` after the one before; `device_n`: the device's force until then.
  void update(const hal::RigSample& sample, double interval_s, const hal::Vector3& device_n = {}) noexcept;
  /// A sample was unfit: what happened meanwhile is not known. While the zero is not proven, the motion over
  /// which the reading has stayed what it is goes on: with a clock that is often late it would never be
  /// enough.
  void interrupt() noexcept;
  /// The sensor is not listened to: what it reads next is nothing, as far as drift goes.
  void forget_zero() noexcept;

  /// Time since the reading last showed a load, s. A reading that is back at the zero before a jump which is not
  /// proven shows none: what the watch itself makes of it may be a load, and is not changed by that.
  double unloaded_s() const noexcept { return std::max(unloaded_s_, at_proof_s_); }
  /// A step that may be a jump has not been decided on.
  bool is_suspected() const noexcept { return is_suspected_; }
  /// Returns true if what is read is most likely no object: only a step that was noted under load; a zero from before
  /// a jump that has stayed so in motion; or, once the zero has jumped, a little that has stayed what it was over
  /// kProofMm, until more is read, or next to nothing for a while.
  bool is_left() const noexcept {
    return ((shows_only_noted() || is_back_at_zero_) && unloaded_s() > kFreeAirS) || is_doubtful_;
  }
  /// Returns true if the zero is only a guess: since it was proven, the reading has stepped several times, or a little
  /// is read that is_left() takes for jumps.
  bool is_unsure() const noexcept { return steps_ >= kUnsureSteps || is_doubtful_; }
  /// Whether anything is touched is not known, and no reading counts.
  bool is_waiting() const noexcept { return is_waiting_; }
  /// Whether it waits because of a jump.
  bool has_jumped() const noexcept { return has_jumped_; }
  /// What is to be taken off the reading, sensor frame.
  const hal::Vector3& jump_n() const noexcept { return jump_n_; }
  /// Drift of the zero in addition to jump_n(), sensor frame.
  const hal::Vector3& drift_n() const noexcept { return drift_.value_n(); }
  /// Number of zeros that were waited for since a bias and then found by motion. After each of them jump_n() is that
  /// zero, and drift_n() is the rest of what the sensor reads of nothing.
  std::uint32_t found_count() const noexcept { return found_count_; }
  /// Jumps so far, and the last one.
  std::uint32_t jump_count() const noexcept { return jump_count_; }
  const hal::Vector3& last_jump_n() const noexcept { return last_jump_n_; }

 private:
  static constexpr double kSlotS = 0.75e-3;  // ended by the first tick after it: a millisecond at 1 kHz
  static constexpr double kMaxSlotS = 4e-3;  // a longer one hides what happened in it
  static constexpr std::size_t kSlots = 16;
  static constexpr std::size_t kBefore = 3;
  static constexpr std::size_t kAfter = 4;
  static constexpr std::size_t kStepSlots = kBefore + 2 + kAfter;
  static constexpr std::size_t kHalf = 6;  // slots of half the triangle: an encoder count is 20 mN at most
  static constexpr double kMaxLonger = 3.0;     // than the mean of a triangle's slots: more hides what happened in it
  static constexpr double kIntegratedS = 0.25;  // at once: a mean of six slots is then exact to 1e-13 of the reading
  static constexpr double kFlatShare = 0.15;
  static constexpr double kSeenShare = 0.6;  // of a step, between the slots next to it
  static constexpr double kFlatN = 0.02;  // six deviations of a slot's noise
  static constexpr double kRisesN = 0.012;
  static constexpr double kStepDeviations = 4.0;         // of what the sensor's noise is beyond a usual one's
  static constexpr double kLoadedStepDeviations = 14.0;  // there two slopes are known as badly
  static constexpr double kUnchangedN = 0.025;
  static constexpr double kRestMm = 0.06;  // two counts of an encoder in kHalf slots
  static constexpr double kKeepN = 0.012;  // below every threshold of contact
  static constexpr double kWrongN = 0.08;  // of a zero that was proven: beyond what violent motion leaves
  static constexpr double kMassError = 0.35;
  static constexpr double kUnseenMmPerS2 = 60e3;  // no hand moves a tool like that
  static constexpr double kHandMmPerS2 = 20e3;    // a brisk one does
  static constexpr double kPeakFadeS = 0.05;      // what violent motion set swinging fades no faster
  static constexpr double kPeakRestS = 1.0;       // while the tool is free: who throws it may throw it again
  static constexpr double kImpactMmPerS = 50.0;
  static constexpr double kPressedS = 0.02;      // since the last load: it is pressed
  static constexpr std::size_t kHalfSwingSlots = 16;  // of an arm that swings at 30 Hz or faster
  static constexpr double kSwingS = 0.1;  // so long after the last load a swing is taken to go on
  static constexpr double kTurnCosine = 0.5;
  static constexpr double kDipShare = 0.1;  // of the peak of late
  static constexpr double kAlongShare = 0.1;  // of a slot, in the direction that a reading is compared with
  static constexpr double kHeldShare = 0.6;
  static constexpr double kHeldMm = 0.3;
  static constexpr std::size_t kLeftSlots = 2;
  static constexpr double kLeftMm = 0.3;
  static constexpr double kLittleN = 2.0 * kLoadedStepN;  // two jumps that were not seen under a load
  static constexpr double kQuietN = 0.02;
  static constexpr std::size_t kQuietSlots = 50;
  static constexpr double kStaysMm = 0.5;
  static constexpr double kForgetsNotedS = 0.25;
  static constexpr double kKnockS = 0.15;
  static constexpr std::uint32_t kUnsureSteps = 2;
  static constexpr double kSettleS = 0.5;
  static constexpr double kSettleTimeS = 0.1;
  static constexpr double kSettleNPerS = 0.2;
  static constexpr double kAlongCosine = 0.9;
  static constexpr double kLongS = 1.0;  // unloaded_s_ counts no further

  /// Mean of the reading (sensor frame, weight taken off) and where the tip was at its end.
  struct Slot {
    hal::Vector3 reading_n;
    hal::Vector3 twice_n_s2;  ///< the readings integrated twice up to its end: their mean under a triangle is a
                              ///< second difference of it, as the acceleration is one of the positions
    hal::Vector3 weight_n;
    hal::Vector3 tip_mm;
    hal::Vector3 device_n;
    double length_s = 0.0;
    double end_s = 0.0;       ///< time that the integral is of
    double unloaded_s = 0.0;  ///< before it
  };
  /// What the sensor bears: the reading less its zero; and the same with inertia taken off, which is late.
  struct Load {
    hal::Vector3 prompt_n;
    hal::Vector3 mean_n;  ///< with inertia, over the slots of the window: less noisy
    hal::Vector3 steady_n;
    hal::Vector3 acceleration_mm_per_s2{};  ///< under the same weights
    bool has_inertia = false;               ///< it was taken off
    bool is_inertia_unknown = false;        ///< after a gap and between uneven slots
    double inertia_n = 0.0;                 ///< magnitude of what was taken off
    double unseen_n = 0.0;  ///< of the inertia that the encoders do not show: the device bends under its force
    double swing_n = 0.0;   ///< the same of the device's force and the load
  };

  const Slot& before(std::size_t age) const noexcept { return slots_[newest_ - age]; }
  /// All that is read is a step that was noted under load.
  bool shows_only_noted() const noexcept { return noted_slots_ > kLeftSlots; }
  /// Returns true if the reading has stayed what it is over so much of motion.
  bool stays_over(double mm) const noexcept {
    return has_stretch_ && exceeds(before(0).tip_mm - stretch_tip_mm_, mm);
  }
  /// Share of a peak that is left after `s`.
  static double left_of_peak(double s, double fade_s) noexcept { return 1.0 - std::min(s / fade_s, 1.0); }
  void take_bias(const hal::RigSample& sample) noexcept;
  /// Takes so much more of a reading for weight in the zero, of those that are remembered, too.
  void add_to_readings(const hal::Vector3& by_n) noexcept;
  /// The tool's weight, sensor frame.
  hal::Vector3 weight_n(const hal::RigSample& sample) const noexcept;
  hal::Vector3 zero_n() const noexcept { return jump_n_ + first_n_ + drift_.value_n(); }
  /// The present zero is that of free air.
  void prove() noexcept;
  void end_slot(const hal::RigSample& sample, const hal::Vector3& device_n) noexcept;
  /// Remembers the slot that ends now.
  void remember(const hal::RigSample& sample, const hal::Vector3& device_n) noexcept;
  /// Starts the integrals again at the end of the last slot, so that their rounding does not grow with time.
  void shift_integrals() noexcept;
  /// Follows the zero with what a free tool reads, for a slot of `s`.
  void follow_drift(const hal::Vector3& reading_n, double s) noexcept;
  Load load(const hal::Quaternion& to_rig, const hal::Vector3& zero) const noexcept;
  /// What is read cannot be the tool's own.
  bool shows_load(const Load& now) const noexcept { return shows_load(now, now.prompt_n, now.steady_n); }
  /// Whether a reading that differs by some zero cannot be the tool's own.
  bool shows_load(const Load& now, const hal::Vector3& prompt_n, const hal::Vector3& steady_n) const noexcept;
  /// Returns true if the reading is the zero that was proven last, with the last jump since or without it, or one that
  /// was taken for it since. It then shows no load, or one that is as large as the other jumps and against them.
  bool is_back_at_proof(const Load& now) const noexcept;
  /// Returns true if the reading would show no load were the zero smaller by `off_n`, and is nearer to that zero.
  bool is_nothing_without(const hal::Vector3& off_n, const Load& now) const noexcept;
  /// What is read is what is left of the load that was seen last.
  bool is_held(const Load& now) const noexcept;
  /// Counts the slots in which all that is read is the step that was noted under load.
  void follow_noted(const Load& load) noexcept;
  /// What is read may be the arm's swing after the last load.
  bool is_swing(const Load& now) noexcept;
  /// The zero has jumped by that much.
  void jump(const hal::Vector3& by_n) noexcept;
  /// The tip has hardly moved of late.
  bool is_at_rest() const noexcept {
    return filled_ > kHalf && !exceeds(before(0).tip_mm - before(kHalf).tip_mm, kRestMm);
  }
  /// The slots of both halves of the triangle are there, none much longer than the others.
  bool has_window() const noexcept;
  /// Least step that is one, of a load or not, on a sensor as noisy as this.
  double least_step_n(bool loaded) const noexcept {
    const double noise_n = noise_.excess_n();
    return loaded ? kLoadedStepN + kLoadedStepDeviations * noise_n : kStepN + kStepDeviations * noise_n;
  }
  void suspect() noexcept;
  /// Returns true if none of the last slots is much longer than the others.
  bool are_even(std::size_t slots) const noexcept;
  bool find_step() noexcept;
  /// The tip was stopped by what made the reading step.
  bool is_impact() const noexcept;
  void follow(const Load& load, const hal::Quaternion& to_rig) noexcept;
  void begin_stretch(const Load& load, const hal::Quaternion& to_rig) noexcept;
  /// The stretch shows free air.
  bool is_proven() const noexcept;
  void take_over(const hal::Vector3& zero_n) noexcept;
  /// Ends the wait after a jump if the reading grows with the way.
  void look_for_object(const Load& load, const hal::Quaternion& to_rig) noexcept;

  LoadMonitorParameters parameters_{};
  bool is_turned_ = false;  ///< the sensor, in the tool
  double inertia_error_ = kMassError;  ///< share by which the tool's inertia may be another
  bool has_other_tool_ = false;
  hal::Vector3 weight_in_zero_n_;
  /// A ring, written twice, so that what it holds also is in one piece, the newest last at newest_.
  std::array<Slot, 2 * kSlots> slots_{};
  std::size_t newest_ = 0;  ///< 0: there has been none
  bool is_after_gap_ = true;  ///< there are not yet enough slots to know the acceleration
  std::size_t filled_ = 0;  ///< of them, those since the last interruption, up to kSlots
  std::size_t short_slots_ = 0;  ///< running, too short to be much longer than others
  hal::Vector3 once_n_s_;        ///< the readings integrated once, up to the end of the last slot
  // The slot under way.
  double under_way_s_ = 0.0;
  hal::Vector3 under_way_n_;  ///< sum of its readings
  std::uint32_t looks_ = 0;   ///< their number
  bool has_zero_ = false;
  std::uint32_t bias_serial_ = 0;
  std::uint32_t proven_serial_ = 0;
  hal::Vector3 last_reading_n_;
  hal::Vector3 last_weight_n_;
  hal::Vector3 jump_n_;
  hal::Vector3 first_n_;  ///< with what it began, taken for nothing until something is proven
  DriftTracker drift_;
  // As they were when the zero was proven last: a reading that comes back there is free.
  bool has_proof_ = false;
  hal::Vector3 proven_jump_n_;
  hal::Vector3 proven_first_n_;
  /// Zeros that were taken for it since, each until the reading jumped in free air. The oldest gives way.
  std::array<hal::Vector3, 3> former_n_{};
  std::size_t formers_ = 0;  ///< their number so far
  hal::Vector3 last_since_proof_n_;  ///< the last jump since
  BasicReadingNoise<hal::Vector3> noise_;
  double peak_inertia_n_ = 0.0;  ///< of late
  double swing_n_ = 0.0;         ///< that the tool's mass may show of late
  // The reading since it was nothing, turned or fell to little.
  std::size_t run_slots_ = 0;
  double run_peak_n_ = 0.0;  ///< fading
  bool may_swing_ = false;
  hal::Vector3 run_along_n_;
  double settling_s_ = 0.0;      ///< left, of what was taken over
  double unloaded_s_ = 0.0;
  double at_proof_s_ = 0.0;  ///< running, in which the reading was back at the zero that was proven last
  bool is_back_at_zero_ = false;  ///< and has stayed so in motion
  bool is_doubtful_ = false;      ///< what is read may be several jumps, each too small to be seen under a load
  std::size_t quiet_slots_ = 0;   ///< running, in which next to nothing was read
  hal::Vector3 held_n_;       ///< the load that was seen last, without inertia
  hal::Vector3 held_tip_mm_;  ///< where the tip was then
  bool is_suspected_ = false;
  bool is_waiting_ = false;
  bool has_jumped_ = false;
  hal::Vector3 noted_n_;       ///< steps under load; zero: none
  hal::Vector3 last_noted_n_;  ///< the last of them
  double since_noted_s_ = kLongS;
  std::uint32_t steps_ = 0;        ///< noted ones and jumps since the zero was proven
  hal::Vector3 last_read_tip_mm_;  ///< where the tip was when more than nothing was read last
  std::size_t noted_slots_ = 0;  ///< running, in which nothing else was read
  std::size_t other_slots_ = 0;  ///< running, in which there was
  hal::Vector3 noted_tip_mm_;    ///< at the first of those
  hal::Vector3 suspected_along_;  ///< unit vector of what may be a step
  std::size_t suspected_slots_ = 0;
  std::size_t rises_ = 0;  ///< running, since then
  // The stretch over which the reading has stayed what it is.
  StiffnessFit3 fit_;  ///< since the jump
  bool has_stretch_ = false;
  bool is_as_proven_ = false;
  hal::Vector3 stretch_load_n_;
  hal::Vector3 stretch_tip_mm_;
  hal::Vector3 stretch_sum_n_;  ///< of what is left of it without inertia, of all slots but the first 2 kHalf - 1
  std::size_t stretch_slots_ = 0;
  hal::Vector3 stretch_along_;  ///< unit vector of its load, rig frame; zero if there is none
  double lowest_mm_ = 0.0;      ///< along it
  std::uint32_t found_count_ = 0;
  std::uint32_t jump_count_ = 0;
  hal::Vector3 last_jump_n_;
};

}  // namespace hapticd::rt
