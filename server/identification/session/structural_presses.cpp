#include <algorithm>
#include <cmath>

#include "rt/signal/vector.h"
#include "server/identification/session/structural_identification.h"

namespace hapticd::identification {

namespace {

constexpr double kLoadedN = 0.05;      // less does not count as a press: friction and DAC steps are of this
                                       // size
constexpr double kFirmN = 0.5;         // a press whose peak is less says nothing
constexpr double kMovingMmPerS = 3.0;  // below, the sign of friction is not known
constexpr double kQuasiStaticNPerS = 80.0;
// Rigid contact. Below, the two surfaces still settle; the encoders move by the bend alone, and slower than
// this they may stick while the force changes.
constexpr double kBendingMmPerS = 1.0;
// On hardware: a winding cools in some twelve seconds, and a press that begins at this heat stays below what
// a device warns at, 0.8.
constexpr double kCoolingTimeS = 12.0;
constexpr double kWarmedHeat = 0.3;
constexpr double kCooledHeat = 0.25;

double component(const hal::Vector3& v, std::size_t i) noexcept {
  return i == 0 ? v.x : i == 1 ? v.y : v.z;
}

}  // namespace

void StructuralIdentification::warm_up(const rt::Observation& observation) noexcept {
  const double continuous_n = rig_.device.max_continuous_force_n;
  if (rig_.kind != hal::RigKind::kHardware || !(continuous_n > 0.0)) return;
  const std::int64_t now_ns = observation.sample.time_ns;
  const double step_s = 1e-9 * static_cast<double>(now_ns - heated_at_ns_);
  heated_at_ns_ = now_ns;
  if (!(step_s > 0.0 && step_s < 1.0)) return;
  // An arm that gives less in its pose warms more for the same force.
  const double pose_n = observation.sample.max_force_n;
  const double weaker =
      pose_n > 0.0 && rig_.device.max_force_n > pose_n ? rig_.device.max_force_n / pose_n : 1.0;
  const double ratio = rt::norm(observation.device_command_n) / continuous_n * weaker;
  heat_ += (ratio * ratio - heat_) * std::min(1.0, step_s / kCoolingTimeS);
  cooling_ = heat_ > (cooling_ ? kCooledHeat : kWarmedHeat);
}

void StructuralIdentification::take(const Row& row) {
  const bool loaded = rt::norm(row.force_n) > (task_.rigid_contact ? kSettledN : kLoadedN);
  if (!pressing_) {
    if (!loaded) {
      if (task_.rigid_contact) return;  // off the object the tip goes anywhere
      before_[before_next_] = row;
      before_next_ = (before_next_ + 1) % kBefore;
      before_count_ = std::min(before_count_ + 1, kBefore);
      return;
    }
    pressing_ = true;
    press_ = Press{};
    free_rows_ = 0;
    for (std::size_t i = 0; i < before_count_; ++i) {
      accumulate(press_, before_[i]);
      press_.points_zero_mm =
          press_.points_zero_mm + before_[i].deflection_mm * (1.0 / static_cast<double>(before_count_));
    }
    if (task_.rigid_contact) {
      press_.points_zero_mm = row.deflection_mm;
      press_.points_zero_n = rt::norm(row.force_n);
    }
    before_count_ = 0;
    before_next_ = 0;
  }
  if (loaded || !task_.rigid_contact) accumulate(press_, row);
  const double force_n = rt::norm(row.force_n);
  if (force_n > press_.force_n) {
    press_.force_n = force_n;
    press_.reaction_n = row.reaction_n;
    press_.place_mm = row.place_mm;
    press_.axis = 2;
    for (int i = 0; i < 2; ++i) {
      if (std::abs(component(row.force_n, static_cast<std::size_t>(i))) >
          std::abs(component(row.force_n, static_cast<std::size_t>(press_.axis)))) {
        press_.axis = i;
      }
    }
  }
  if (loaded && --rows_until_point_ <= 0 && press_.point_count < press_.points.size()) {
    const double along_mm = dot(row.deflection_mm - press_.points_zero_mm, row.force_n) / force_n;
    press_.points[press_.point_count++] = {force_n, along_mm, 0.0};
    rows_until_point_ = static_cast<int>(0.1 * rig_.rate_hz);
  }
  free_rows_ = loaded ? 0 : free_rows_ + 1;
  if (free_rows_ >= free_rows_after_) close_press();
}

void StructuralIdentification::accumulate(Press& press, const Row& row) const noexcept {
  for (std::size_t i = 0; i < 3; ++i) {
    const double speed = component(row.velocity_mm_per_s, i);
    const double force = component(row.force_n, i);
    const double rate = component(row.force_rate_n_per_s, i);
    const double deflection = component(row.deflection_mm, i);
    if (std::abs(rate) > kQuasiStaticNPerS) continue;
    if (std::abs(speed) < (task_.rigid_contact ? kBendingMmPerS : kMovingMmPerS)) continue;
    if (std::abs(deflection) > 1e4) continue;  // sums of absurd numbers would drown the rest
    press.axes[i].add({row.place_mm, force, speed, rate, deflection});
  }
}

void StructuralIdentification::close_press() {
  pressing_ = false;
  const StructuralSums& sums = press_.axes[static_cast<std::size_t>(press_.axis)];
  if (press_.force_n < kFirmN || sums.rows < 20.0) {
    ++faint_presses_;
    return;
  }
  rows_used_ += static_cast<std::uint64_t>(sums.rows);
  if (presses_.size() < kMaxPresses) {
    presses_.push_back(press_);
  } else {
    presses_[presses_seen_ % kMaxPresses] = press_;
  }
  ++presses_seen_;
  const StructuralFit now = fit(0);
  if (now.good) {
    if (history_.size() >= 64) history_.erase(history_.begin());
    history_.push_back(now.model.stiffness_n_per_mm);
  }
  if (task_.rigid_contact) rigid_enough_ = progress().converged;
}

}  // namespace hapticd::identification
