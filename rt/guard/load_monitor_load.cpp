// What the sensor bears, and whether it can be the tool's own.

#include <algorithm>
#include <cmath>

#include "rt/guard/load_monitor.h"
#include "rt/signal/tool_compensation.h"
#include "rt/signal/vector.h"

namespace hapticd::rt {

bool LoadMonitor::has_window() const noexcept {
  if (filled_ < 2 * kHalf + 1) return false;
  if (short_slots_ >= 2 * kHalf) return true;
  double longest_s = 0.0;
  for (std::size_t age = 0; age < 2 * kHalf; ++age) longest_s = std::max(longest_s, before(age).length_s);
  return longest_s * (2 * kHalf) < kMaxLonger * (before(0).end_s - before(2 * kHalf).end_s);
}

LoadMonitor::Load LoadMonitor::load(const hal::Quaternion& to_rig, const hal::Vector3& zero) const noexcept {
  const hal::Vector3 prompt_n = before(0).reading_n - zero;
  if (!has_window()) {
    return {.prompt_n = prompt_n,
            .mean_n = prompt_n,
            .steady_n = prompt_n,
            .is_inertia_unknown = is_after_gap_ || filled_ > 2 * kHalf};
  }
  // Under the triangle over both halves, by time: slots may be of uneven length.
  const double latter_s = before(0).end_s - before(kHalf).end_s;
  const double former_s = before(kHalf).end_s - before(2 * kHalf).end_s;
  const double over_s = 2.0 / (former_s + latter_s);
  const double per_latter = over_s / latter_s;
  const double per_former = over_s / former_s;
  const auto second_difference = [&](hal::Vector3 Slot::*of) {
    const hal::Vector3& middle = before(kHalf).*of;
    return (before(0).*of - middle) * per_latter - (middle - before(2 * kHalf).*of) * per_former;
  };
  const hal::Vector3 acceleration = second_difference(&Slot::tip_mm);
  const hal::Vector3 inertia_n =
      rotated(conjugate(to_rig), acceleration * inertial_force_n(parameters_.tool_mass_g, 1.0));
  const hal::Vector3 mean_n = second_difference(&Slot::twice_n_s2) - zero;
  // The tool's mass times the way that a newton bends the device.
  const double per_n_s2 =
      inertial_force_n(parameters_.tool_mass_g + parameters_.mass_error_g, parameters_.compliance_mm_per_n);
  double unseen_n = 0.0;
  double swing_n = 0.0;
  if (per_n_s2 > 0.0) {
    unseen_n = norm(second_difference(&Slot::device_n)) * per_n_s2;
    swing_n = unseen_n + norm(second_difference(&Slot::reading_n)) * per_n_s2;
  }
  return {.prompt_n = prompt_n,
          .mean_n = mean_n,
          .steady_n = mean_n + inertia_n,
          .acceleration_mm_per_s2 = acceleration,
          .has_inertia = true,
          .inertia_n = norm(inertia_n),
          .unseen_n = unseen_n,
          .swing_n = swing_n};
}

bool LoadMonitor::shows_load(const Load& now, const hal::Vector3& prompt_n,
                             const hal::Vector3& steady_n) const noexcept {
  const double size_n = norm(prompt_n);
  if (!(size_n > kLoadN)) return false;
  const double most_mass_g = parameters_.tool_mass_g + parameters_.mass_error_g;
  const double least_n = kLoadN + now.unseen_n + inertia_error_ * peak_inertia_n_;
  if (size_n > least_n + inertial_force_n(most_mass_g, kUnseenMmPerS2)) return true;
  // If the acceleration is not known, a free tool may have a hand's; what was pressed still is.
  if (now.is_inertia_unknown && unloaded_s_ > kPressedS) {
    return size_n > least_n + inertial_force_n(most_mass_g, kHandMmPerS2);
  }
  return dot(steady_n, prompt_n) > size_n * least_n;
}

bool LoadMonitor::is_back_at_proof(const Load& now) const noexcept {
  if (!has_proof_ || formers_ == 0)
    return false;  // without a jump since, the zero is the one that was proven
  const hal::Vector3 present_n = jump_n_ + first_n_;
  const hal::Vector3 off_n = present_n - proven_jump_n_ - proven_first_n_;
  // Under a load a zero jumps back unseen: then only the last of several jumps is left.
  if (is_nothing_without(off_n, now) || is_nothing_without(off_n - last_since_proof_n_, now)) return true;
  for (std::size_t i = 0; i < std::min(formers_, former_n_.size()); ++i) {
    if (is_nothing_without(present_n - former_n_[i], now)) return true;
  }
  return false;
}

bool LoadMonitor::is_nothing_without(const hal::Vector3& off_n, const Load& now) const noexcept {
  if (!exceeds(off_n, kLoadN)) return false;
  const hal::Vector3 prompt_n = now.prompt_n + off_n;
  return squared(prompt_n) < squared(now.prompt_n) && !shows_load(now, prompt_n, now.steady_n + off_n);
}

bool LoadMonitor::is_held(const Load& now) const noexcept {
  // A tool that was shaken so much of late may bounce.
  if (unloaded_s_ > kPressedS || squared(noted_n_) > 0.0 || peak_inertia_n_ > kLoadN) return false;
  return !exceeds(before(0).tip_mm - held_tip_mm_, kHeldMm) &&
         dot(now.steady_n, held_n_) > kHeldShare * squared(held_n_);
}

bool LoadMonitor::is_swing(const Load& now) noexcept {
  const double size_n = norm(now.prompt_n);
  const bool turns = dot(now.prompt_n, run_along_n_) < kTurnCosine * size_n * norm(run_along_n_);
  run_peak_n_ *= left_of_peak(before(0).length_s, kPeakFadeS);
  if (run_slots_ == 0 || turns || size_n < kDipShare * run_peak_n_) {
    run_slots_ = 0;
    run_along_n_ = now.prompt_n;
    run_peak_n_ = size_n;
    // What rises out of free air says nothing of what swings, what falls or turns does.
    const double of_now_n = unloaded_s_ < kPressedS ? now.swing_n : now.unseen_n;
    may_swing_ = std::max(swing_n_, of_now_n) > kLoadN || (may_swing_ && unloaded_s_ < kSwingS);
  }
  ++run_slots_;
  run_peak_n_ = std::max(run_peak_n_, size_n);
  run_along_n_ = run_along_n_ + (now.prompt_n - run_along_n_) * kAlongShare;
  swing_n_ = std::max(swing_n_, now.swing_n);
  if (run_slots_ > kHalfSwingSlots) may_swing_ = false;
  return may_swing_;
}

}  // namespace hapticd::rt
