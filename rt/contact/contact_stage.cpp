#include "rt/contact/contact_stage.h"

#include <algorithm>
#include <cmath>

#include "rt/signal/vector.h"

namespace hapticd::rt {

namespace {

double inner(double a, double b) noexcept {
  return a * b;
}
double inner(const hal::Vector3& a, const hal::Vector3& b) noexcept {
  return dot(a, b);
}

}  // namespace

template <class Value>
void BasicContactStage<Value>::reset() noexcept {
  residual_.reset();
  detector_.reset();
  evidence_.reset();
  onset_.forget();
  in_motion_.reset();
  is_zero_ = false;
  waiting_s_ = load_s_ = 0.0;
  may_load_ = missed_load_ = false;
  since_proven_s_ = kLeftS;
}

template <class Value>
void BasicContactStage<Value>::remember_proven(const Input& now) noexcept {
  const double least_n = in_motion_.kMaxN;  // of less the direction is noise
  if (!evidence_.proven() || force_n_ < least_n) return;
  since_proven_s_ = 0.0;
  proven_mm_ = now.free_motion.position_mm;
  proven_n_ = residual_.residual_n();
}

template <class Value>
bool BasicContactStage<Value>::has_left_object(const Input& now) const noexcept {
  if (since_proven_s_ >= kLeftS || force_n_ >= in_motion_.kMaxN) return false;
  if (parameters_.method != ContactMethod::kMatchedInertia) return false;
  // The residual points into what pushes.
  const double into_n_mm = inner(now.free_motion.position_mm - proven_mm_, proven_n_);
  return into_n_mm < -kLeftMm * magnitude(proven_n_);
}

template <class Value>
void BasicContactStage<Value>::notice_missed_load(const TickInterval& interval) noexcept {
  // Hum lets a tool look free for a tick, again and again.
  free_s_ = detector_.is_waiting() ? 0.0 : std::min(free_s_ + interval.s, kSeenFreeS);
  if (free_s_ >= kSeenFreeS) {
    missed_load_ = false;
    load_s_ = 0.0;
    may_load_ = true;
  } else if (force_n_ > kMissedN) {
    if (may_load_) load_s_ = std::min(load_s_ + interval.s, kMissedS);
    missed_load_ = missed_load_ || load_s_ >= kMissedS;
  } else if (force_n_ < 0.5 * kMissedN) {
    load_s_ = 0.0;
    may_load_ = true;
  }
}

template <class Value>
void BasicContactStage<Value>::follow_free_reading(const Input& now) noexcept {
  const bool is_beyond = force_n_ >= detector_.threshold_n();
  since_proven_s_ = std::min(since_proven_s_ + now.interval.s, kLeftS);
  if (has_left_object(now)) {
    is_zero_ = true;
    in_motion_.reset();
  } else if (is_beyond && parameters_.method == ContactMethod::kMatchedInertia) {
    is_zero_ = in_motion_.update(residual_.residual_n(), now.tip_mm, now.interval.s);
  } else {
    is_zero_ = false;
    in_motion_.reset();
  }
  if (!detector_.is_waiting() || !is_beyond) {
    waiting_s_ = 0.0;
  } else if (magnitude(now.velocity_mm_per_s) > kMovingMmPerS && force_n_ < in_motion_.kMaxN) {
    waiting_s_ = std::min(waiting_s_ + now.interval.s, 2.0 * kWaitingS);
  }
  notice_missed_load(now.interval);
  const Value varies_n = residual_.prompt_force_n() - free_mean_n_;
  free_mean_n_ = free_mean_n_ + varies_n * (now.interval.s / (now.interval.s + kNoiseMeanS));
  const double one_n = magnitude(varies_n) / std::sqrt(stiffness_fit::components(Value{}));
  evidence_.rest(now.acceleration_mm_per_s2, is_beyond ? evidence_.noise_n() : one_n, now.interval);
}

template <class Value>
bool BasicContactStage<Value>::may_be_met(const Input& now) const noexcept {
  if (force_n_ <= parameters_.threshold_n || force_n_ > evidence_.max_free_force_n()) return true;
  const double speed_mm_per_s = magnitude(now.velocity_mm_per_s);
  if (speed_mm_per_s < kMovingMmPerS) return true;
  // Signed as the residual is: what opposes the motion is along it.
  return inner(residual_.residual_n(), now.velocity_mm_per_s) > -kAlongCosine * force_n_ * speed_mm_per_s;
}

template <class Value>
void BasicContactStage<Value>::detect(const Input& now) noexcept {
  if (parameters_.method == ContactMethod::kFilteredAcceleration) {
    force_n_ = now.reaction_n;
    detector_.update(force_n_, now.depth_mm, now.contact_depth_mm);
  } else {
    // A contact that is not proven may be noise itself: the noise must be learnt all the same.
    if (!in_contact() || !evidence_.proven()) {
      noise_.update(now.free_motion.force_n, now.free_motion.force_ns);
    }
    const double excess_n = noise_.excess_n();
    residual_.set_excess_noise(excess_n);
    detector_.set_excess_noise(excess_n);
    evidence_.set_excess_noise(excess_n);
    residual_.update(now.free_motion, in_contact());
    if (now.interval.is_gap) [[unlikely]] {
      // What was free stays free; an onset within the gap was not seen, and none is placed across it.
      onset_.forget();
      if (detector_.is_free()) {
        residual_.start_free();
        if (magnitude(now.free_motion.force_n) > evidence_.max_free_force_n()) detector_.await_free();
      }
    } else if (after_gap_ && detector_.is_free()) {
      residual_.start_free();  // the reading before was a mean over the gap
    }
    after_gap_ = now.interval.is_gap;
    onset_.remember(now.tip_mm, residual_.prompt_force_n(), residual_.prompt_force_ns(),
                    1e-9 * static_cast<double>(now.free_motion.position_ns - now.free_motion.force_ns));
    force_n_ = magnitude(residual_.residual_n());
    detector_.update(force_n_, now.depth_mm, now.contact_depth_mm, residual_.irregular_n(),
                     in_contact() || may_be_met(now));
    if (detector_.just_left_surface()) {
      // What still pulls above the surface of an object that never resisted was none, if it does so again and
      // again.
      unproven_ = evidence_.proven() ? 0 : unproven_ + 1;
      if (unproven_ >= kUnprovenToWithdraw && force_n_ > parameters_.threshold_n) detector_.withdraw();
      residual_.assume_free();
    }
  }
  if (detector_.just_declared()) note_onset(now.free_motion.position_ns);
  quiet_s_ = force_n_ < parameters_.threshold_n ? quiet_s_ + now.interval.s : 0.0;
  if (quiet_s_ > kQuietS) unproven_ = 0;
  begins_ = false;
  if (!in_contact()) return follow_free_reading(now);
  is_zero_ = false;
  in_motion_.reset();
  waiting_s_ = load_s_ = 0.0;
  missed_load_ = false;
  begins_ = detector_.just_declared() || (now.interval.is_gap && !is_still_held(now));
  if (begins_) evidence_.begin();
  held_tip_mm_ = now.tip_mm;
  held_n_ = now.reaction_n;
  remember_proven(now);
}

template <class Value>
bool BasicContactStage<Value>::is_still_held(const Input& now) const noexcept {
  return magnitude(now.tip_mm - held_tip_mm_) <= kHeldMm && now.reaction_n > kHeldShare * held_n_;
}

template <class Value>
void BasicContactStage<Value>::judge(const ContactEvidence::Observation& now,
                                     const TickInterval& interval) noexcept {
  evidence_.update(now, interval);
  if (evidence_.plausible()) return;
  if (evidence_.proven()) {
    detector_.lose();
  } else {
    detector_.withdraw();
  }
  residual_.assume_free();
}

template <class Value>
double BasicContactStage<Value>::quiet_n() const noexcept {
  return parameters_.release_ratio * parameters_.threshold_n + residual_.seen_jerk_n() +
         kQuietDeviations * noise_.excess_n();
}

template <class Value>
Value BasicContactStage<Value>::onset_mm() const noexcept {
  return onset_.place_mm(quiet_n());
}

template <class Value>
void BasicContactStage<Value>::note_onset(std::int64_t now_ns) noexcept {
  const bool looks_back = parameters_.method == ContactMethod::kMatchedInertia;
  onset_instant_ = looks_back ? onset_.instant(quiet_n()) : OnsetInstant{now_ns, 0, now_ns};
}

template class BasicContactStage<double>;
template class BasicContactStage<hal::Vector3>;

}  // namespace hapticd::rt
