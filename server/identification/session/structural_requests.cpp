#include <algorithm>
#include <cmath>

#include "rt/signal/vector.h"
#include "server/identification/session/fixed_text.h"
#include "server/identification/session/structural_identification.h"

namespace hapticd::identification {

namespace {

// Soft enough that the device presses with 2 … 3 times the hand's force, stiff enough to stay steady.
constexpr double kRigidTarget = 1.0;  // N/mm
constexpr double kRigidHandN = 2.0;   // the device adds k_s / kRigidTarget times as much
// Soft enough that a press runs through 10 mm and more: an instrument's calibration error averages out on the
// way.
constexpr double kStiffWall = 0.45;  // N/mm
constexpr double kSoftWall = 0.3;
constexpr double kRestS = 1.0;
constexpr std::size_t kMaxRounds = 8;
constexpr std::size_t kPressesInVain = 3;  // so often it was not for want of a firm hand

}  // namespace

bool StructuralIdentification::visited(std::size_t target) const noexcept {
  constexpr double kNearMm = 45.0;  // a press ends well below where it began
  return std::any_of(presses_.begin(), presses_.end(), [&](const Press& press) {
    return rt::norm(press.place_mm - targets_mm_[target]) < kNearMm && press.force_n > 0.5 * press_force_n_;
  });
}

std::vector<Coverage> StructuralIdentification::places() const {
  Coverage sideways({"x", "mm", -kAsideMm * 1.5, kAsideMm * 1.5, 3},
                    {"y", "mm", -kAcrossMm * 1.5, kAcrossMm * 1.5, 3});
  Coverage upward({"z", "mm", kMiddleMm - 1.5 * kUpDownMm, kMiddleMm + 1.5 * kUpDownMm, 3},
                  {"force", "N", 0.0, press_force_n_, 2});
  for (const hal::Vector3& target : targets_mm_) {
    sideways.required[sideways.cell_at(target.x, target.y)] = 1;
    upward.required[upward.cell_at(target.z, press_force_n_)] = 1;
  }
  for (const Press& press : presses_) {
    ++sideways.counts[sideways.cell_at(press.place_mm.x, press.place_mm.y)];
    ++upward.counts[upward.cell_at(press.place_mm.z, press.force_n)];
  }
  sideways.update_share();
  upward.update_share();
  return {sideways, upward};
}

MotionRequest StructuralIdentification::press_at(std::size_t target, const char* why) const {
  MotionRequest request;
  request.motion = MotionRequest::Motion::kPress;
  request.device = MotionRequest::Device::kWall;
  request.stiffness_n_per_mm =
      (target + presses_seen_ / targets_mm_.size()) % 2 == 0 ? kStiffWall : kSoftWall;
  request.force_n = press_force_n_;
  request.force_rate_n_per_s = 12.0;
  request.hold_s = 0.05;
  request.place_mm = targets_mm_[target];
  // Heights are staggered: an instrument whose calibration is off periodically, watched at a few heights
  // only, would pass that off as a field. Multiples of the golden section, modulo one, fill an interval
  // evenly.
  const double golden = 0.6180339887 * static_cast<double>(presses_seen_);
  request.place_mm.z += kStaggerMm * (golden - std::floor(golden) - 0.5);
  request.words = why + fixed_text(request.place_mm.x, 0) + " mm aside, " +
                  fixed_text(request.place_mm.y, 0) + " mm across and " + fixed_text(request.place_mm.z, 0) +
                  " mm above the home, to " + fixed_text(press_force_n_, 1) + " N, and let go";
  return request;
}

MotionRequest StructuralIdentification::press_rigid() const {
  MotionRequest request;
  request.motion = MotionRequest::Motion::kPress;
  request.device = MotionRequest::Device::kModulation;
  request.stiffness_n_per_mm = kRigidTarget;
  // The object does not give way; the encoders do, by f_d/k_s. Compensated, any force would be too little.
  request.encoders_as_they_are = true;
  request.max_device_force_n = 1.5 * press_force_n_;
  if (rig_.device.max_force_n > 0.0) {
    request.max_device_force_n = std::min(request.max_device_force_n, rig_.device.max_force_n);
  }
  request.force_n = kRigidHandN;
  request.force_rate_n_per_s = 4.0;
  request.hold_s = 0.05;
  const std::string how =
      " to " + fixed_text(kRigidHandN, 0) + " N in half a second, straight down, and let go";
  request.words = gives_way() ? "the object gives way: press " + rigid_object() + "," + how
                              : "press the rigid object" + how + ": the device presses on with more";
  return request;
}

std::size_t StructuralIdentification::wanted_presses() const noexcept {
  return task_.rigid_contact ? kRigidPresses : targets_mm_.size();
}

std::size_t StructuralIdentification::pressed_enough() const noexcept {
  std::size_t done = 0;
  if (task_.rigid_contact) {
    for (const Press& press : presses_) done += press.force_n > 0.5 * press_force_n_ ? 1U : 0U;
    return std::min(done, kRigidPresses);
  }
  for (std::size_t i = 0; i < targets_mm_.size(); ++i) done += visited(i) ? 1U : 0U;
  return done;
}

bool StructuralIdentification::gives_way() const noexcept {
  return task_.rigid_contact && presses_seen_ + faint_presses_ >= kPressesInVain && pressed_enough() == 0;
}

MotionRequest StructuralIdentification::next_request() const {
  // In the middle of a press nothing is taken away.
  if (must_cool() && !pressing_) {
    MotionRequest rest;
    rest.hold_s = kRestS;
    rest.words = "let go for some seconds: the motors of the device have to cool";
    return rest;
  }
  if (task_.rigid_contact) {
    return !rigid_enough_ && presses_seen_ < kMaxRounds * kRigidPresses ? press_rigid() : MotionRequest{};
  }
  if (outside_missing_ > 0 && outside_missing_ == gate_.judged()) {
    MotionRequest request;
    request.words = "let an instrument from outside say where the tip is: the encoders cannot see the bend";
    return request;
  }
  for (std::size_t i = 0; i < targets_mm_.size(); ++i) {
    if (!visited(i)) return press_at(i, "press the wall ");
  }
  if (!progress().converged && presses_seen_ < kMaxRounds * targets_mm_.size()) {
    return press_at(presses_seen_ % targets_mm_.size(), "press the wall once more ");
  }
  return {};
}

}  // namespace hapticd::identification
