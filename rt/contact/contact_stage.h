#pragma once

#include "hal/samples.h"
#include "rt/contact/contact_detector.h"
#include "rt/contact/contact_evidence.h"
#include "rt/contact/contact_onset.h"
#include "rt/contact/free_motion_residual.h"
#include "rt/contact/reading_in_motion.h"
#include "rt/signal/reading_noise.h"
#include "rt/signal/tick_interval.h"

namespace hapticd::rt {

/// Contact as a scene has it: detected from what free motion leaves unexplained, held while there is evidence
/// of an object, and ended without. `Value` is a number along the press axis or a vector in the rig frame.
template <class Value>
class BasicContactStage {
 public:
  BasicContactStage(const ContactParameters& parameters, double tool_mass_g, double rate_hz) noexcept
      : parameters_(parameters),
        residual_(tool_mass_g, rate_hz),
        detector_(parameters, rate_hz),
        evidence_(parameters.evidence, parameters.threshold_n, tool_mass_g),
        onset_(rate_hz) {}

  /// What one tick measured.
  struct Input {
    TickInterval interval;
    /// Force the sensor bears besides its zero and the tool's weight, with the position and their instants.
    typename BasicFreeMotionResidual<Value>::Measurement free_motion;
    Value tip_mm{};             ///< where an onset is placed
    Value velocity_mm_per_s{};  ///< of the tip, signed as `free_motion.position_mm`
    double reaction_n = 0.0;    ///< magnitude of f_r, for the published method
    double depth_mm = 0.0;      ///< and where the present contact began, along one line into the object
    double contact_depth_mm = 0.0;
    double acceleration_mm_per_s2 = 0.0;  ///< magnitude
  };

  /// Begins, holds and releases a contact by the force.
  void detect(const Input& now) noexcept;
  /// Judges a contact: ends it if nothing speaks for it, and counts what does.
  void judge(const ContactEvidence::Observation& now, const TickInterval& interval) noexcept;
  /// A contact law knows of an onset that was missed.
  void declare(std::int64_t now_ns) noexcept {
    detector_.declare();
    onset_instant_ = {now_ns, 0, now_ns};
  }
  /// Withdraws the contact: what is felt is not an object.
  void withdraw() noexcept {
    detector_.withdraw();
    residual_.assume_free();
  }
  /// The sensor's zero is not proven: a contact was none, and the tool is not known to be free.
  void distrust() noexcept {
    may_load_ = may_load_ && !in_contact();
    if (in_contact()) {
      withdraw();
    } else if (detector_.is_free()) {
      detector_.await_free();
    }
  }
  /// Whether something is touched is not known.
  void await_free() noexcept {
    may_load_ = may_load_ && !in_contact();
    detector_.await_free();
  }
  void reset() noexcept;

  const ContactDetector& detector() const noexcept { return detector_; }
  bool in_contact() const noexcept { return detector_.in_contact(); }
  /// True in the tick from which on its evidence counts: it was declared, or not held over a gap.
  bool begins() const noexcept { return begins_; }
  /// Share of the desired force that may be rendered, 0 … 1; 0 out of contact.
  double authority() const noexcept { return in_contact() ? evidence_.authority() : 0.0; }
  /// Authority without what a slope alone allows.
  double earned_authority() const noexcept { return in_contact() ? evidence_.earned_authority() : 0.0; }
  /// False if every contact is rendered in full from its declaration on, as published.
  bool needs_evidence() const noexcept { return parameters_.evidence.required; }
  /// What may be rendered at most on the evidence so far; infinite once all is earned.
  double max_force_n() const noexcept { return evidence_.max_force_n(); }
  /// What a sensor may read in free air at most, whatever the hand does.
  double max_free_force_n() const noexcept { return evidence_.max_free_force_n(); }
  /// Place at which a contact that has just been declared began.
  Value onset_mm() const noexcept;
  /// Instant at which the present contact began, or the last. Its place is that of onset_mm() when it was
  /// declared.
  const OnsetInstant& onset() const noexcept { return onset_instant_; }
  /// What the threshold is compared with.
  double force_n() const noexcept { return force_n_; }
  /// True if what the sensor reads besides the tool, residual_n(), shows its zero.
  bool zero_shows() const noexcept {
    return parameters_.method == ContactMethod::kMatchedInertia && detector_.zero_shows(force_n_);
  }
  const Value& residual_n() const noexcept { return residual_.residual_n(); }
  /// True if residual_n() is the zero's although it is beyond the threshold: it stays what it is in motion.
  bool zero_shows_in_motion() const noexcept { return is_zero_; }
  /// True if it has been waiting in motion for so long that the sensor's zero must be wrong, or if a load has
  /// come meanwhile that was not rendered.
  bool waits_in_motion() const noexcept { return waiting_s_ > kWaitingS || missed_load_; }
  /// True if the sensor is too noisy for a contact to be told from it.
  bool is_too_noisy() const noexcept { return noise_.is_too_much(); }

 private:
  /// What a force in free motion may be after all.
  double quiet_n() const noexcept;
  void note_onset(std::int64_t now_ns) noexcept;

  ContactParameters parameters_;
  BasicFreeMotionResidual<Value> residual_;
  ContactDetector detector_;
  ContactEvidence evidence_;
  BasicContactOnset<Value> onset_;
  OnsetInstant onset_instant_{};
  /// Contacts in a row that never resisted, without a quiet time between: a bouncing tool makes one or two.
  static constexpr int kUnprovenToWithdraw = 3;
  static constexpr double kQuietS = 0.02;
  static constexpr double kMovingMmPerS = 10.0;
  static constexpr double kAlongCosine = 0.5;

  /// Whether what is felt may be an object that the tip meets: it opposes the motion. A force along the
  /// motion is what a stop leaves, whose inertia is known a filter's delay late: a surface cannot push the
  /// tip the way it goes. Unless it is more than free motion can leave.
  bool may_be_met(const Input& now) const noexcept;

  /// Returns true if the tip is where it was in the last tick and bears about as much: over a gap, the same
  /// object is held.
  bool is_still_held(const Input& now) const noexcept;
  void follow_free_reading(const Input& now) noexcept;
  /// Remembers where a proven contact was and which way the object pushed.
  void remember_proven(const Input& now) noexcept;
  /// Returns true if the tip has drawn back from a proven contact just now: what little is read is the zero,
  /// which has drifted on unseen.
  bool has_left_object(const Input& now) const noexcept;
  /// Notices a load of kMissedN that came and has lasted for kMissedS while a free tool is waited for.
  void notice_missed_load(const TickInterval& interval) noexcept;

  static constexpr double kWaitingS = 2.0;
  static constexpr double kMissedN = 0.3;
  static constexpr double kMissedS = 0.3;
  static constexpr double kSeenFreeS = 0.1;
  static constexpr double kLeftS = 0.6;
  static constexpr double kLeftMm = 2.0;
  static constexpr double kHeldMm = 0.1;
  static constexpr double kHeldShare = 0.9;
  static constexpr double kQuietDeviations = 2.5;  // of a single reading's noise
  static constexpr double kNoiseMeanS = 0.01;      // what changes more slowly, the slope's acceleration takes

  // The last tick of a proven contact:
  double since_proven_s_ = kLeftS;
  Value proven_mm_{};
  Value proven_n_{};
  BasicReadingInMotion<Value> in_motion_;
  bool is_zero_ = false;
  double waiting_s_ = 0.0;
  double load_s_ = 0.0;     ///< how long the present load has lasted
  bool may_load_ = false;   ///< the tool was seen unloaded: a load is one that has come since
  bool missed_load_ = false;
  bool begins_ = false;
  Value held_tip_mm_{};  ///< in the last tick in contact
  double held_n_ = 0.0;  ///< and the reaction
  double free_s_ = 0.0;  ///< how long the tool has been seen free, up to kSeenFreeS
  BasicReadingNoise<Value> noise_;
  Value free_mean_n_{};  ///< of what a free tool reads, of late
  double force_n_ = 0.0;
  int unproven_ = 0;
  bool after_gap_ = false;
  double quiet_s_ = 0.0;
};

using ContactStage = BasicContactStage<double>;
using ContactStage3 = BasicContactStage<hal::Vector3>;
extern template class BasicContactStage<double>;
extern template class BasicContactStage<hal::Vector3>;

}  // namespace hapticd::rt
