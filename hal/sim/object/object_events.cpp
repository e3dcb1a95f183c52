#include "hal/sim/object/object_events.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "hal/sim/base/range_check.h"

namespace hapticd::sim {

using hal::Vector3;

namespace {

constexpr const char* kWhere = "object of a simulated rig";

// An object that slides on the table is braked by the film it slides on, so that its speed follows from the
// force that is left: 10 N·s/m.
constexpr double kSlidingMmPerSPerN = 100.0;

/// Turns a vector about y: from x towards -z for a positive angle.
Vector3 turned(const Vector3& v, double rad) noexcept {
  const double c = std::cos(rad);
  const double s = std::sin(rad);
  return {c * v.x + s * v.z, v.y, -s * v.x + c * v.z};
}

}  // namespace

std::optional<hal::Error> check(const ObjectEvent& event) {
  for (const double along : {event.move_mm.x, event.move_mm.y, event.move_mm.z}) {
    if (auto error = out_of_range("move_mm", kWhere, along, -200.0, 200.0, "mm")) return error;
  }
  if (auto error = out_of_range("tilt_deg", kWhere, event.tilt_deg, -45.0, 45.0, "°")) return error;
  if (auto error = out_of_range("at_s", kWhere, event.at_s, -1e9, 1e9, "s")) return error;
  return out_of_range("duration_s", kWhere, event.duration_s, 0.0, 3600.0, "s");
}

std::optional<hal::Error> check(const ObjectHold& hold) {
  if (hold.edge_mm) {
    if (auto error = out_of_range("edge_mm", kWhere, *hold.edge_mm, -200.0, 200.0, "mm")) return error;
  }
  if (auto error = out_of_range("edge_round_mm", kWhere, hold.edge_round_mm, 0.0, 20.0, "mm")) return error;
  return out_of_range("slides_above_n", kWhere, hold.slides_above_n, 0.0, 100.0, "N");
}

bool ObjectEventQueue::push(const ObjectEvent& event) noexcept {
  const std::size_t pushed = pushed_.load(std::memory_order_relaxed);
  if (pushed - popped_.load(std::memory_order_acquire) == kCapacity) return false;
  events_[pushed % kCapacity] = event;
  pushed_.store(pushed + 1, std::memory_order_release);
  return true;
}

bool ObjectEventQueue::pop(ObjectEvent& event) noexcept {
  const std::size_t popped = popped_.load(std::memory_order_relaxed);
  if (popped == pushed_.load(std::memory_order_acquire)) return false;
  event = events_[popped % kCapacity];
  popped_.store(popped + 1, std::memory_order_release);
  return true;
}

bool ObjectSchedule::add(const ObjectEvent& event) noexcept {
  if (count_ == kCapacity) return false;
  std::size_t at = count_++;
  for (; at > 0 && events_[at - 1].at_s <= event.at_s; --at) events_[at] = events_[at - 1];
  events_[at] = event;
  return true;
}

bool ObjectSchedule::due(double time_s, ObjectEvent& event) noexcept {
  if (count_ == 0 || events_[count_ - 1].at_s > time_s) return false;
  event = events_[--count_];
  return true;
}

void ObjectPose::begin(const ObjectEvent& event) noexcept {
  displaced_ = true;
  const double rad = event.tilt_deg * std::numbers::pi / 180.0;
  switch (event.kind) {
    case ObjectEvent::Kind::kVanish:
      present_ = false;
      break;
    case ObjectEvent::Kind::kReturn:  // decided by the caller, which knows where the tip is
      break;
    case ObjectEvent::Kind::kMove:
      if (event.duration_s <= 0.0) {
        offset_mm_ = offset_mm_ + event.move_mm;
      } else {
        move_rate_mm_per_s_ = event.move_mm * (1.0 / event.duration_s);
        move_left_s_ = event.duration_s;
      }
      break;
    case ObjectEvent::Kind::kTilt:
      if (event.duration_s <= 0.0) {
        tilt_rad_ += rad;
      } else {
        tilt_rate_rad_per_s_ = rad / event.duration_s;
        tilt_left_s_ = event.duration_s;
      }
      break;
  }
}

void ObjectPose::advance(const Vector3& pushed_n) noexcept {
  moved_last_mm_ = {};
  turned_last_rad_ = 0.0;
  if (move_left_s_ > 0.0) {
    moved_last_mm_ = move_rate_mm_per_s_ * std::min(step_s_, move_left_s_);
    move_left_s_ -= step_s_;
  }
  if (tilt_left_s_ > 0.0) {
    turned_last_rad_ = tilt_rate_rad_per_s_ * std::min(step_s_, tilt_left_s_);
    tilt_left_s_ -= step_s_;
  }
  if (hold_.slides_above_n > 0.0) {
    const double push_n = std::hypot(pushed_n.x, pushed_n.y);
    if (push_n > hold_.slides_above_n) {
      const double share = kSlidingMmPerSPerN * step_s_ * (push_n - hold_.slides_above_n) / push_n;
      moved_last_mm_ = moved_last_mm_ + Vector3{share * pushed_n.x, share * pushed_n.y, 0.0};
    }
  }
  offset_mm_ = offset_mm_ + moved_last_mm_;
  tilt_rad_ += turned_last_rad_;
}

Vector3 ObjectPose::to_object(const Vector3& rig_mm) const noexcept {
  return turned(rig_mm - offset_mm_, -tilt_rad_);
}
Vector3 ObjectPose::to_rig(const Vector3& object_mm) const noexcept {
  return turned(object_mm, tilt_rad_) + offset_mm_;
}
Vector3 ObjectPose::direction_to_rig(const Vector3& in_object) const noexcept {
  return turned(in_object, tilt_rad_);
}

Vector3 ObjectPose::moved_mm(const Vector3& rig_mm) const noexcept {
  const Vector3 arm = rig_mm - offset_mm_;
  return moved_last_mm_ + Vector3{arm.z, 0.0, -arm.x} * turned_last_rad_;
}

double ObjectPose::share_at(const Vector3& object_mm) const noexcept {
  if (!present_) return 0.0;
  if (!hold_.edge_mm) return 1.0;
  const double inside_mm = *hold_.edge_mm - object_mm.x;
  if (inside_mm <= 0.0) return 0.0;
  if (inside_mm >= hold_.edge_round_mm) return 1.0;
  const double s = inside_mm / hold_.edge_round_mm;
  return s * s * (3.0 - 2.0 * s);
}

}  // namespace hapticd::sim
