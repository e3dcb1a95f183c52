#include "rt/assist/presentation_monitor.h"

#include <algorithm>
#include <cmath>

#include "rt/signal/vector.h"

namespace hapticd::rt {

namespace {

/// Longest gap between two samples: beyond it, what happened is not known.
constexpr double kLostS = 0.010;

struct WatchRange {
  const char* name;
  double value;
  double most;
};

}  // namespace

std::optional<hal::Error> check(const WatchLimits& limits, const std::string& where) {
  const WatchRange ranges[] = {
      {"max_press_speed_mm_per_s", limits.max_press_speed_mm_per_s, 2000.0},
      {"max_lateral_mm", limits.max_lateral_mm, 500.0},
      {"max_contact_speed_mm_per_s", limits.max_contact_speed_mm_per_s, 2000.0},
      {"max_contacts", static_cast<double>(limits.max_contacts), 1000.0},
      {"min_lateral_path_mm", limits.min_lateral_path_mm, 10'000.0},
      {"min_contact_s", limits.min_contact_s, 100.0},
  };
  for (const WatchRange& range : ranges) {
    if (range.value >= 0.0 && range.value <= range.most) continue;
    return hal::Error::of(hal::ErrorCode::kOutOfRange,
                          std::string("watch.") + range.name + " is out of range", where,
                          std::to_string(range.value), "0 … " + std::to_string(range.most),
                          "give a value within the range; 0 = no limit");
  }
  return std::nullopt;
}

void PresentationMonitor::begin(std::uint32_t number) noexcept {
  summary_ = {};
  summary_.number = number;
  is_running_ = true;
  has_first_contact_ = false;
  was_in_contact_ = false;
  free_s_ = kNewContactS;
  approach_mm_per_s_ = 0.0;
}

PresentationSummary PresentationMonitor::end() noexcept {
  if (is_running_) {
    if (summary_.lateral_path_mm < limits_.min_lateral_path_mm) summary_.broken |= watch_bit::kLateralPath;
    if (summary_.contacts == 0) {
      summary_.broken |= watch_bit::kNoContact;
    } else if (summary_.contact_s < limits_.min_contact_s) {
      summary_.broken |= watch_bit::kContactTime;
    }
  }
  is_running_ = false;
  return summary_;
}

void PresentationMonitor::follow_contact(const WatchedTick& now, double interval_s) noexcept {
  const hal::Vector3 across_mm = now.tip_mm - axis_ * dot(now.tip_mm, axis_);
  if (!was_in_contact_) {
    if (free_s_ >= kNewContactS) {
      ++summary_.contacts;
      summary_.peak_contact_speed_mm_per_s =
          std::max(summary_.peak_contact_speed_mm_per_s, approach_mm_per_s_);
    }
    if (!has_first_contact_) first_contact_mm_ = across_mm;
    has_first_contact_ = true;
  } else {
    summary_.lateral_path_mm += norm(across_mm - last_contact_mm_);
  }
  free_s_ = 0.0;
  last_contact_mm_ = across_mm;
  summary_.contact_s += interval_s;
  summary_.peak_lateral_mm = std::max(summary_.peak_lateral_mm, norm(across_mm - first_contact_mm_));
  summary_.peak_force_n = std::max(summary_.peak_force_n, now.reaction_n);
  summary_.peak_displacement_mm = std::max(summary_.peak_displacement_mm, now.displacement_mm);
}

void PresentationMonitor::update(const WatchedTick& now, bool is_touched,
                                 const hal::Vector3& velocity_mm_per_s, double interval_s) noexcept {
  if (!is_running_) return;
  if (summary_.begin_tick == 0) summary_.begin_tick = now.tick;
  summary_.end_tick = now.tick;

  const double inward_mm_per_s = dot(velocity_mm_per_s, axis_);
  summary_.peak_press_speed_mm_per_s = std::max(summary_.peak_press_speed_mm_per_s, inward_mm_per_s);
  approach_age_s_ += interval_s;
  const double speed_mm_per_s = norm(velocity_mm_per_s);
  if (speed_mm_per_s >= approach_mm_per_s_ || approach_age_s_ > kApproachS) {
    approach_mm_per_s_ = speed_mm_per_s;
    approach_age_s_ = 0.0;
  }
  free_s_ += interval_s;
  if (is_touched) follow_contact(now, interval_s);
  was_in_contact_ = is_touched;

  const auto beyond = [](double value, double limit) { return limit > 0.0 && value > limit; };
  if (beyond(summary_.peak_press_speed_mm_per_s, limits_.max_press_speed_mm_per_s))
    summary_.broken |= watch_bit::kPressSpeed;
  if (beyond(summary_.peak_lateral_mm, limits_.max_lateral_mm)) summary_.broken |= watch_bit::kLateral;
  if (beyond(summary_.peak_contact_speed_mm_per_s, limits_.max_contact_speed_mm_per_s))
    summary_.broken |= watch_bit::kContactSpeed;
  if (limits_.max_contacts > 0 && summary_.contacts > limits_.max_contacts)
    summary_.broken |= watch_bit::kContacts;
  if (now.is_held_back) summary_.broken |= watch_bit::kGuard;
  if (now.is_limited) ++summary_.guard_limited_ticks;
  if (interval_s > 1.5 * period_s_) ++summary_.late_ticks;
  if (interval_s > kLostS) summary_.broken |= watch_bit::kTicksLost;
}

}  // namespace hapticd::rt
