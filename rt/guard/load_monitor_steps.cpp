// Jumps of the sensor's zero by their shape.

#include <algorithm>
#include <array>
#include <cmath>

#include "rt/guard/load_monitor.h"
#include "rt/signal/vector.h"

namespace hapticd::rt {

void LoadMonitor::suspect() noexcept {
  if (filled_ < 5) return;
  const hal::Vector3& now_n = before(0).reading_n;
  if (is_suspected_) {
    // The reading of a contact goes on to change; a jump is over within two slots. A little is what a load
    // does anyway.
    const auto change_n = [this](std::size_t young, std::size_t old) {
      return dot(before(young).reading_n - before(old).reading_n, suspected_along_);
    };
    constexpr double kGoesOn = 0.3;
    constexpr double kLittle = 0.03;  // of the step, in a slot
    const double step_n = change_n(suspected_slots_ + 1, suspected_slots_ + 3);
    const double least_n = std::max(std::max(kRisesN, kLittle * step_n), kGoesOn * std::abs(change_n(1, 2)));
    const bool goes_on = change_n(0, 1) * change_n(1, 2) > 0.0 && std::abs(change_n(0, 1)) > least_n;
    rises_ = goes_on ? rises_ + 1 : 0;
    if (++suspected_slots_ > kAfter + 2 || rises_ >= 2) is_suspected_ = false;
    return;
  }
  const hal::Vector3 over_two_n = now_n - before(2).reading_n;
  if (!exceeds(over_two_n, kStepN) || !exceeds(over_two_n, least_step_n(false))) return;
  const hal::Vector3 earlier_n = before(2).reading_n - before(4).reading_n;
  if (exceeds(earlier_n, kFlatN + 0.3 * norm(over_two_n))) return;  // it has been changing all along
  is_suspected_ = true;
  suspected_along_ = over_two_n * (1.0 / norm(over_two_n));
  suspected_slots_ = 0;
  rises_ = 0;
}

bool LoadMonitor::is_impact() const noexcept {
  const auto velocity = [this](std::size_t from, std::size_t to) {
    return (before(to).tip_mm - before(from).tip_mm) * (1.0 / (3.0 * before(to).length_s));
  };
  const hal::Vector3 then = velocity(8, 5);
  const hal::Vector3 now = velocity(3, 0);
  return exceeds(now - then, kImpactMmPerS) && !exceeds(now, 0.5 * norm(then));
}

bool LoadMonitor::are_even(std::size_t slots) const noexcept {
  constexpr double kMaxLonger = 2.2;
  double longest_s = 0.0;
  double sum_s = 0.0;
  for (std::size_t age = 0; age < slots; ++age) {
    longest_s = std::max(longest_s, before(age).length_s);
    sum_s += before(age).length_s;
  }
  return longest_s * static_cast<double>(slots) < kMaxLonger * sum_s;
}

bool LoadMonitor::find_step() noexcept {
  if (!is_suspected_ || suspected_slots_ + 2 < kAfter || filled_ < kStepSlots) return false;
  const auto reading = [this](std::size_t age) -> const hal::Vector3& { return before(age).reading_n; };
  static_assert(kBefore == 3 && kAfter == 4);
  std::array<double, kStepSlots> at_s;  // the middles of the slots: they may be of uneven length
  double end_s = 0.0;
  for (std::size_t age = 0; age < kStepSlots; ++age) {
    const double length_s = before(age).length_s;
    at_s[age] = end_s - 0.5 * length_s;
    end_s -= length_s;
  }
  const double slot_s = -end_s / kStepSlots;
  const auto slope = [&](std::size_t young, std::size_t old) {  // a slot
    return (reading(young) - reading(old)) * (slot_s / (at_s[young] - at_s[old]));
  };
  const auto off_line = [&](std::size_t age, std::size_t young, std::size_t old) {
    return reading(age) - reading(old) - slope(young, old) * ((at_s[age] - at_s[old]) / slot_s);
  };
  const hal::Vector3 slope_after = slope(0, 3);
  const hal::Vector3 slope_before = slope(6, 8);
  const hal::Vector3 mean_after = (reading(0) + reading(1) + reading(2) + reading(3)) * 0.25;
  const hal::Vector3 mean_before = (reading(6) + reading(7) + reading(8)) * (1.0 / 3.0);
  const hal::Vector3 zero = zero_n();
  const bool was_loaded = exceeds(mean_before - zero, kLoadN);
  // A slot that is much longer hides what a reaction did in it.
  if (was_loaded && !are_even(kStepSlots)) return false;
  const double apart =
      (0.25 * (at_s[0] + at_s[1] + at_s[2] + at_s[3]) - (at_s[6] + at_s[7] + at_s[8]) * (1.0 / 3.0)) / slot_s;
  hal::Vector3 step_n = mean_after - mean_before;
  if (was_loaded) step_n = step_n - (slope_after + slope_before) * (0.5 * apart);
  const double size_n = norm(step_n);
  if (size_n < least_step_n(was_loaded)) return false;
  // Two steep lines may miss each other although nothing stepped, as on an arm that swings.
  if (dot(reading(kAfter - 1) - reading(kAfter + 2), step_n) < kSeenShare * size_n * size_n) return false;
  const double flat_n = kFlatN + kFlatShare * size_n;
  // An orientation that jumps, not the sensor.
  if (exceeds(before(0).weight_n - before(8).weight_n, 0.5 * kStepN)) return false;
  // Under a load, which may change meanwhile, what the step itself points to is flat.
  const auto bent_n = [&](const hal::Vector3& v) {
    return was_loaded ? std::abs(dot(v, step_n)) / size_n : norm(v);
  };
  if (bent_n(slope_after - slope_before) > flat_n / kAfter) return false;
  if (bent_n(off_line(1, 0, 3) + off_line(2, 0, 3)) > 2.0 * flat_n) return false;
  if (bent_n(off_line(7, 6, 8)) > flat_n) return false;
  const bool is_pressed = !is_waiting_ && before(kAfter + 2).unloaded_s < kPressedS;
  if (!is_pressed && !exceeds(mean_after - zero, kLoadN)) return false;  // what was felt has gone
  if (exceeds(jump_n_ + step_n, kMaxJumpN) || is_impact()) return false;
  is_suspected_ = false;
  filled_ = kAfter;  // the step is to be found once
  if (is_pressed) {
    noted_n_ = noted_n_ + step_n;
    last_noted_n_ = step_n;
    settling_s_ = 0.0;
    ++steps_;
    if (!exceeds(noted_n_, kLoadedStepN)) {
      noted_n_ = {};
      if (since_noted_s_ < kKnockS) steps_ -= std::min(steps_, 2U);  // a knock, and its end
    }
    since_noted_s_ = 0.0;
    noted_slots_ = 0;
    return true;
  }
  fit_.reset();
  if (has_jumped_ && has_proof_ && !exceeds(jump_n_ + step_n - proven_jump_n_, kLoadN)) {
    // Back to what was proven: both were loads, a knock on what is held down, or the zero is what it was.
    jump_n_ = proven_jump_n_;
    is_waiting_ = has_jumped_ = false;
    return true;
  }
  jump(step_n);
  return true;
}

void LoadMonitor::jump(const hal::Vector3& by_n) noexcept {
  ++jump_count_;
  ++steps_;
  last_jump_n_ = by_n;
  noted_slots_ = 0;
  is_waiting_ = has_jumped_ = true;
  has_stretch_ = false;
  former_n_[formers_++ % former_n_.size()] = jump_n_ + first_n_;
  jump_n_ = jump_n_ + by_n;
  last_since_proof_n_ = by_n;
  unloaded_s_ = kLongS;
}

void LoadMonitor::follow_noted(const Load& load) noexcept {
  if (squared(noted_n_) == 0.0) return;
  const auto shows_more_than = [&](const hal::Vector3& step_n) {
    const hal::Vector3 prompt_n = load.prompt_n - step_n;
    // Once the object is left, noise at the threshold does not bring it back.
    return shows_load(load, prompt_n, load.steady_n - step_n) &&
           (!shows_only_noted() || exceeds(prompt_n, 2.0 * kLoadN));
  };
  bool is_other = shows_more_than(noted_n_);
  hal::Vector3 left_n = noted_n_;
  // The jump before may have gone as well, unseen under the load; how much it was shows in free air
  // afterwards.
  const hal::Vector3 back_n = proven_jump_n_ - jump_n_;
  if (is_other && has_proof_ && exceeds(back_n, kLoadN)) {
    left_n = noted_n_ + back_n;
    is_other = shows_more_than(left_n);
  }
  // A step that was missed before, and its end noted, is in the sum of the steps only: then just the last one
  // is left.
  if (is_other && exceeds(noted_n_ - last_noted_n_, kLoadN) && !shows_more_than(last_noted_n_)) {
    left_n = last_noted_n_;
    is_other = false;
  }
  // While the tool is thrown about, hardly anything shows a load. What is nearer to nothing than to the step,
  // with its inertia or without, is not the step, and says nothing of it.
  const double nearest_n2 = std::min(dot(load.steady_n, left_n), dot(load.prompt_n, left_n));
  if (!is_other && nearest_n2 < 0.5 * squared(left_n)) {
    noted_slots_ = other_slots_ = 0;
    return;
  }
  // One slot of noise does not make a load of it again.
  other_slots_ = is_other ? other_slots_ + 1 : 0;
  if (is_other && (!shows_only_noted() || other_slots_ > kLeftSlots)) {
    noted_slots_ = 0;
  } else if (noted_slots_++ == 0) {
    noted_tip_mm_ = before(0).tip_mm;
  }
}

}  // namespace hapticd::rt
