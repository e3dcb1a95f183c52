#include "rt/guard/load_monitor.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "rt/signal/tool_compensation.h"
#include "rt/signal/vector.h"

namespace hapticd::rt {

namespace {

constexpr double kGravityMmPerS2 = 9807.0;

constexpr hal::Vector3 clamped(const hal::Vector3& v, double bound) noexcept {
  return {std::clamp(v.x, -bound, bound), std::clamp(v.y, -bound, bound), std::clamp(v.z, -bound, bound)};
}

/// Returns which way is up in the frame of a tool that is turned by q, however a driver rounded it.
constexpr hal::Vector3 up_in(const hal::Quaternion& q) noexcept {
  const double xx_yy = q.x * q.x + q.y * q.y;
  const double ww_zz = q.w * q.w + q.z * q.z;
  const double squared = xx_yy + ww_zz;
  if (!(squared > 1e-12 && squared <= std::numeric_limits<double>::max())) return {0.0, 0.0, 1.0};
  return hal::Vector3{2.0 * (q.x * q.z - q.w * q.y), 2.0 * (q.y * q.z + q.w * q.x), ww_zz - xx_yy} *
         (1.0 / squared);
}

constexpr bool is_same(const hal::Quaternion& a, const hal::Quaternion& b) noexcept {
  return a.w == b.w && a.x == b.x && a.y == b.y && a.z == b.z;
}

}  // namespace

void LoadMonitor::set_parameters(const LoadMonitorParameters& parameters) noexcept {
  const bool is_other = parameters.tool_mass_g != parameters_.tool_mass_g ||
                        !is_same(parameters.sensor_to_tool, parameters_.sensor_to_tool);
  parameters_ = parameters;
  is_turned_ = parameters.sensor_to_tool.w != 1.0;
  const double mass_g = parameters.tool_mass_g;
  inertia_error_ = kMassError + (mass_g > 0.0 ? parameters.mass_error_g / mass_g : 0.0);
  if (parameters.knows_weight_in_zero) add_to_readings(parameters.weight_in_zero_n - weight_in_zero_n_);
  has_other_tool_ = has_zero_ && is_other;
}

void LoadMonitor::add_to_readings(const hal::Vector3& by_n) noexcept {
  weight_in_zero_n_ = weight_in_zero_n_ + by_n;
  drift_.shift(by_n);
  last_reading_n_ = last_reading_n_ + by_n;
  under_way_n_ = under_way_n_ + by_n * looks_;
  once_n_s_ = once_n_s_ + by_n * before(0).end_s;
  for (Slot& slot : slots_) {
    slot.reading_n = slot.reading_n + by_n;
    slot.twice_n_s2 = slot.twice_n_s2 + by_n * (0.5 * slot.end_s * slot.end_s);
  }
}

void LoadMonitor::interrupt() noexcept {
  noted_slots_ = 0;
  is_after_gap_ = true;
  filled_ = 0;
  under_way_s_ = 0.0;
  looks_ = 0;
  is_suspected_ = false;
  has_stretch_ = has_stretch_ && is_waiting_;
}

void LoadMonitor::forget_zero() noexcept {
  interrupt();
  has_stretch_ = has_zero_ = false;
  noted_n_ = {};
}

// A separate function, as update() is: among all that is flattened into a tick its numbers would go to the
// stack and back.
[[gnu::noinline]] hal::Vector3 LoadMonitor::weight_n(const hal::RigSample& sample) const noexcept {
  const hal::Vector3 weight_n =
      up_in(sample.tip_orientation) * -inertial_force_n(parameters_.tool_mass_g, kGravityMmPerS2);
  return is_turned_ ? rotated(conjugate(parameters_.sensor_to_tool), weight_n) : weight_n;
}

void LoadMonitor::prove() noexcept {
  noted_n_ = {};
  noted_slots_ = 0;
  is_waiting_ = has_jumped_ = is_doubtful_ = false;
  proven_serial_ = bias_serial_;
  has_proof_ = true;
  proven_jump_n_ = jump_n_;
  proven_first_n_ = first_n_;
  last_since_proof_n_ = {};
  formers_ = 0;
  steps_ = 0;
}

void LoadMonitor::take_bias(const hal::RigSample& sample) noexcept {
  const bool is_new = sample.bias_serial != bias_serial_;
  bias_serial_ = sample.bias_serial;
  // A driver that lost its zero changes the number as well, and warns.
  const bool is_lost = (sample.status & hal::sample_status::kForceWarning) != 0;
  if (has_zero_ ? !is_lost : !parameters_.knows_weight_in_zero) weight_in_zero_n_ = weight_n(sample);
  const hal::Vector3 reading = sample.sensor_force_n - weight_n(sample) + weight_in_zero_n_;
  if (has_zero_ && !exceeds(reading - last_reading_n_, kLoadN)) {  // what changes nothing hides no load
    if (!is_waiting_) proven_serial_ = bias_serial_;
    return;
  }
  interrupt();
  has_stretch_ = false;
  has_zero_ = true;
  has_other_tool_ = false;
  if (is_new) {
    jump_n_ = {};
    has_jumped_ = false;
  }
  drift_.shift(drift_.value_n() * -1.0);
  noted_n_ = {};
  first_n_ = reading - jump_n_;
  if (exceeds(first_n_, kLoadN)) is_waiting_ = true;
  has_proof_ = false;
  if (bias_serial_ != proven_serial_) is_waiting_ = true;
  if (!is_waiting_) prove();
}

[[gnu::noinline, gnu::flatten]] void LoadMonitor::update(const hal::RigSample& sample, double interval_s,
                                                         const hal::Vector3& device_n) noexcept {
  under_way_s_ += interval_s;
  // A sensor that is silent shows nothing; for how long that may last is the guard's limit.
  if ((sample.status & hal::sample_status::kForceMissing) != 0) return;
  unloaded_s_ = std::min(unloaded_s_ + interval_s, kLongS);
  if (!has_zero_ || sample.bias_serial != bias_serial_) [[unlikely]] {
    take_bias(sample);
    if (looks_ == 0) under_way_s_ = interval_s;
  }
  const hal::Vector3 weight = weight_n(sample);
  if (has_other_tool_) [[unlikely]] {
    // By its weight alone: what the reading itself changes by meanwhile may be a load.
    drift_.shift(last_weight_n_ - weight);
    interrupt();
    has_stretch_ = false;
    under_way_s_ = interval_s;
    has_other_tool_ = false;
  }
  const hal::Vector3 reading = sample.sensor_force_n - weight + weight_in_zero_n_;
  last_reading_n_ = reading;
  last_weight_n_ = weight;
  under_way_n_ = looks_ == 0 ? reading : under_way_n_ + reading;
  ++looks_;
  if (under_way_s_ >= kSlotS) end_slot(sample, device_n);
}

void LoadMonitor::end_slot(const hal::RigSample& sample, const hal::Vector3& device_n) noexcept {
  const double s = under_way_s_;
  if (s > kMaxSlotS) [[unlikely]] {
    const double looks = looks_;
    const hal::Vector3 sum_n = under_way_n_;
    interrupt();
    const double unknown_n =
        inertial_force_n(parameters_.tool_mass_g + parameters_.mass_error_g, kHandMmPerS2);
    const double least_n = kLoadN + (unloaded_s_ > kPressedS ? unknown_n : 0.0);
    if (exceeds(sum_n * (1.0 / looks) - zero_n(), least_n)) unloaded_s_ = 0.0;
    return;
  }
  remember(sample, device_n);
  drift_.drift_on(s);
  since_noted_s_ = std::min(since_noted_s_ + s, kLongS);
  swing_n_ *= left_of_peak(s, kPeakFadeS);
  // While it waits, the load or the jump may be noise itself: the noise must be learnt all the same.
  if (is_waiting_ || unloaded_s_ > kPressedS) noise_.update(before(0).reading_n, sample.time_ns);
  suspect();
  if (find_step()) return;
  hal::Vector3 zero = zero_n();
  const hal::Vector3 prompt_n = before(0).reading_n - zero;
  const bool is_little = !exceeds(prompt_n, kLoadN);
  const bool is_free = !is_waiting_ && is_little;  // as far as this shows
  if (is_waiting_ && !has_jumped_ && is_little) {
    drift_.follow(prompt_n, s, is_at_rest());
    zero = zero_n();
  }
  peak_inertia_n_ *= left_of_peak(s, is_free ? kPeakRestS : kPeakFadeS);
  if (is_free) {
    at_proof_s_ = 0.0;
    is_back_at_zero_ = false;
    quiet_slots_ = exceeds(prompt_n, kQuietN) ? 0 : quiet_slots_ + 1;
    if (quiet_slots_ >= kQuietSlots) is_doubtful_ = false;
    has_stretch_ = false;
    noted_slots_ = 0;
    // At rest a load and a zero that has jumped by as much look the same.
    const hal::Vector3 moved_mm = before(0).tip_mm - last_read_tip_mm_;
    if (unloaded_s_ > kForgetsNotedS && exceeds(moved_mm, kStaysMm)) noted_n_ = {};
    if (exceeds(moved_mm, kProofMm)) steps_ = 0;
    if (settling_s_ <= 0.0 && unloaded_s_ > kPressedS) return follow_drift(prompt_n, s);
  }
  const hal::Quaternion to_rig =
      is_turned_ ? product(sample.tip_orientation, parameters_.sensor_to_tool) : sample.tip_orientation;
  const Load now = load(to_rig, zero);
  if (is_free) {
    if (is_held(now)) {
      unloaded_s_ = 0.0;
      return;
    }
    if (settling_s_ <= 0.0) return follow_drift(prompt_n, s);
    run_slots_ = 0;
    settling_s_ -= s;
    jump_n_ = jump_n_ + clamped(now.steady_n * (1.0 / kSettleTimeS), kSettleNPerS) * s;
    return prove();
  }
  peak_inertia_n_ = std::max(now.inertia_n, peak_inertia_n_);
  at_proof_s_ = is_back_at_proof(now) ? std::min(at_proof_s_ + s, kLongS) : 0.0;
  is_back_at_zero_ = at_proof_s_ > 0.0 && (is_back_at_zero_ || stays_over(kStaysMm));
  quiet_slots_ = 0;
  last_read_tip_mm_ = before(0).tip_mm;
  is_doubtful_ = jump_count_ > 0 && !exceeds(now.mean_n, kLittleN) && (is_doubtful_ || stays_over(kProofMm));
  follow_noted(now);
  if (shows_only_noted() && exceeds(before(0).tip_mm - noted_tip_mm_, kLeftMm)) {
    jump(std::exchange(noted_n_, {}));
    fit_.reset();
    return;
  }
  if (!is_swing(now) && !shows_only_noted()) {
    if (shows_load(now)) {
      unloaded_s_ = 0.0;
      held_n_ = now.steady_n;
      held_tip_mm_ = before(0).tip_mm;
    } else if (is_held(now)) {
      unloaded_s_ = 0.0;
    }
  }
  if (has_jumped_ && has_proof_) look_for_object(now, to_rig);
  follow(now, to_rig);
}

void LoadMonitor::remember(const hal::RigSample& sample, const hal::Vector3& device_n) noexcept {
  if (newest_ > 0 && before(0).end_s > kIntegratedS) shift_integrals();
  const double s = under_way_s_;
  const hal::Vector3 reading_n = looks_ > 1 ? under_way_n_ * (1.0 / looks_) : under_way_n_;
  const hal::Vector3 twice_n_s2 = before(0).twice_n_s2 + (once_n_s_ + reading_n * (0.5 * s)) * s;
  const double end_s = before(0).end_s + s;
  once_n_s_ = once_n_s_ + reading_n * s;
  if (newest_ == 0 || ++newest_ == 2 * kSlots) newest_ = kSlots;
  slots_[newest_] = slots_[newest_ - kSlots] = {reading_n, twice_n_s2, last_weight_n_, sample.tip_position_mm,
                                                device_n,  s,          end_s,          unloaded_s()};
  filled_ = std::min(filled_ + 1, kSlots);
  if (filled_ > 2 * kHalf) is_after_gap_ = false;
  // No slot is shorter than kSlotS, and so no mean of several.
  short_slots_ = s < kMaxLonger * kSlotS ? short_slots_ + 1 : 0;
  under_way_s_ = 0.0;
  looks_ = 0;
}

void LoadMonitor::shift_integrals() noexcept {
  const double by_s = before(0).end_s;
  const hal::Vector3 by_n_s2 = before(0).twice_n_s2;
  for (Slot& slot : slots_) {
    slot.end_s -= by_s;
    slot.twice_n_s2 = slot.twice_n_s2 - by_n_s2 - once_n_s_ * slot.end_s;
  }
  once_n_s_ = {};
}

void LoadMonitor::follow_drift(const hal::Vector3& reading_n, double s) noexcept {
  run_slots_ = 0;
  drift_.follow(reading_n, s, is_at_rest());
}

void LoadMonitor::look_for_object(const Load& load, const hal::Quaternion& to_rig) noexcept {
  constexpr double kNoiseN = 0.003;
  constexpr double kLowestNPerMm = 0.02;
  constexpr double kGrownN = 0.02;
  if (filled_ < 2 * kHalf + 1) return;
  // The reading pushes the tip back, against the way it came.
  fit_.add(rotated(to_rig, load.steady_n) * -1.0, before(kHalf).tip_mm, load.acceleration_mm_per_s2);
  if (!fit_.shows_object(kNoiseN, kLowestNPerMm, kGrownN)) return;
  is_waiting_ = has_jumped_ = false;
  has_stretch_ = false;
}

void LoadMonitor::begin_stretch(const Load& load, const hal::Quaternion& to_rig) noexcept {
  has_stretch_ = true;
  stretch_load_n_ = load.mean_n;
  stretch_tip_mm_ = before(0).tip_mm;
  stretch_sum_n_ = {};
  stretch_slots_ = 1;
  lowest_mm_ = 0.0;
  // By the mean: a stretch often begins with a reading that noise alone has moved.
  const hal::Vector3 off_n = load.mean_n + jump_n_ + first_n_ - proven_jump_n_ - proven_first_n_;
  is_as_proven_ =
      has_proof_ && formers_ > 0 && !exceeds(off_n, kLoadN) && squared(off_n) < squared(load.mean_n);
  const double size_n = is_as_proven_ ? 0.0 : norm(load.mean_n);
  stretch_along_ = size_n > kLoadN ? rotated(to_rig, load.mean_n) * (1.0 / size_n) : hal::Vector3{};
}

bool LoadMonitor::is_proven() const noexcept {
  const hal::Vector3 moved_mm = before(0).tip_mm - stretch_tip_mm_;
  const double along_mm = dot(moved_mm, stretch_along_);
  if (along_mm - lowest_mm_ >= kRecedeMm) return true;
  if (!(is_waiting_ || is_as_proven_) || !exceeds(moved_mm, kProofMm)) return false;
  // Across a load the reading stays what it is on an object, too: it is stroked.
  const bool is_unloaded = squared(stretch_along_) == 0.0;
  return is_unloaded || along_mm * along_mm > kAlongCosine * kAlongCosine * squared(moved_mm);
}

void LoadMonitor::follow(const Load& load, const hal::Quaternion& to_rig) noexcept {
  // What is read may be the tool's inertia: it proves no wrong zero.
  if (!load.has_inertia && !is_waiting_) return;
  if (!has_stretch_ || exceeds(load.mean_n - stretch_load_n_, kUnchangedN) ||
      exceeds(load.prompt_n - stretch_load_n_, kUnchangedN + kStepDeviations * noise_.excess_n())) {
    return begin_stretch(load, to_rig);
  }
  lowest_mm_ = std::min(lowest_mm_, dot(before(0).tip_mm - stretch_tip_mm_, stretch_along_));
  if (++stretch_slots_ < 2 * kHalf)
    return;  // some of what the mean is of was before the stretch: a load, perhaps
  stretch_sum_n_ = stretch_sum_n_ + load.steady_n;
  if (!is_proven()) return;
  // All that is left is a zero, and so was what this watch began with.
  const hal::Vector3 zero =
      first_n_ + stretch_sum_n_ * (1.0 / static_cast<double>(stretch_slots_ - 2 * kHalf + 1));
  has_stretch_ = false;
  if (is_as_proven_) {
    jump_n_ = proven_jump_n_;
    first_n_ = proven_first_n_;
    unloaded_s_ = kLongS;
    prove();
  } else if (is_waiting_) {
    constexpr double kFollowedN =
        0.02;  // about the threshold of contact: so little the stages follow themselves
    if (!exceeds(zero, kFollowedN)) {
      first_n_ = zero;
      return prove();
    }
    if (exceeds(jump_n_ + zero, kMaxJumpN)) return;
    take_over(zero);
    prove();
    settling_s_ = kSettleS;  // what is read in motion over some milliseconds is off by some millinewtons
  } else if (exceeds(zero, kWrongN) && !exceeds(jump_n_ + zero, kMaxJumpN)) {
    ++jump_count_;
    last_jump_n_ = zero;
    take_over(zero);
    prove();
    settling_s_ = kSettleS;
  }
}

void LoadMonitor::take_over(const hal::Vector3& zero_n) noexcept {
  jump_n_ = jump_n_ + zero_n;
  first_n_ = {};
  unloaded_s_ = kLongS;
  if (is_waiting_ && !has_jumped_) ++found_count_;
}

}  // namespace hapticd::rt
