#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "hal/error.h"
#include "hal/samples.h"

namespace hapticd::rt {

/// What makes the presentation of a stimulus valid; 0 if a limit is not asked for. The defaults are those of
/// D§3.4.1.
struct WatchLimits {
  double max_press_speed_mm_per_s = 150.0;  ///< into the object, along the press axis
  double max_lateral_mm = 15.0;             ///< from the first contact point, across the press axis
  double max_contact_speed_mm_per_s = 0.0;  ///< at which a contact begins; D§4.7: 50
  std::uint32_t max_contacts = 0;           ///< new contacts; D§4.7: 3
  double min_lateral_path_mm = 0.0;         ///< along the surface, in contact; D§4.7: 60
  double min_contact_s = 0.3;  ///< in all: in less an object is hardly felt before its stiffness is rendered

  bool operator==(const WatchLimits&) const = default;
};
/// Nothing, or which value is outside its range.
std::optional<hal::Error> check(const WatchLimits& limits, const std::string& where);

/// What was wrong with a presentation; bits, as several may be.
namespace watch_bit {
inline constexpr std::uint32_t kPressSpeed = 1U << 0;
inline constexpr std::uint32_t kLateral = 1U << 1;
inline constexpr std::uint32_t kContactSpeed = 1U << 2;
inline constexpr std::uint32_t kContacts = 1U << 3;
inline constexpr std::uint32_t kLateralPath = 1U << 4;  ///< judged at the end
inline constexpr std::uint32_t kNoContact = 1U << 5;    ///< judged at the end
inline constexpr std::uint32_t kGuard = 1U << 6;        ///< the guard took the force away
inline constexpr std::uint32_t kTicksLost = 1U << 7;    ///< no sample for more than 10 ms
inline constexpr std::uint32_t kContactTime = 1U << 8;  ///< judged at the end
}  // namespace watch_bit

/// One presentation, from its begin to its end.
struct PresentationSummary {
  std::uint32_t number = 0;  ///< counts from 1; 0 = there was none
  std::uint64_t begin_tick = 0;
  std::uint64_t end_tick = 0;  ///< the last one that is in it
  double peak_press_speed_mm_per_s = 0.0;
  double peak_contact_speed_mm_per_s = 0.0;
  double peak_lateral_mm = 0.0;
  double lateral_path_mm = 0.0;
  double peak_force_n = 0.0;  ///< of the reaction
  double peak_displacement_mm = 0.0;
  double contact_s = 0.0;
  std::uint32_t contacts = 0;
  std::uint32_t guard_limited_ticks = 0;  ///< in which the guard bounded the force
  std::uint32_t late_ticks = 0;           ///< that came more than half a period late
  std::uint32_t broken = 0;               ///< bits of watch_bit; 0 = valid
};

/// What sample, pipeline and guard say of a tick.
struct WatchedTick {
  std::uint64_t tick = 0;
  hal::Vector3 tip_mm;
  double reaction_n = 0.0;  ///< of the object
  double displacement_mm = 0.0;
  bool is_held_back = false;  ///< the guard takes the force away, or gives it back after a clear
  bool is_limited = false;    ///< guard or scene bounded the force
};

/// Watches a presentation tick by tick, so that what makes it valid depends on no network. Bounded work, no
/// allocation.
class PresentationMonitor {
 public:
  PresentationMonitor(const WatchLimits& limits, const hal::Vector3& press_axis, double rate_hz) noexcept
      : limits_(limits), axis_(press_axis), period_s_(1.0 / rate_hz) {}

  /// Begins `number`: the next tick is its first.
  void begin(std::uint32_t number) noexcept;
  /// Ends it: the last tick that was taken was its last.
  PresentationSummary end() noexcept;
  bool is_running() const noexcept { return is_running_; }
  const PresentationSummary& summary() const noexcept { return summary_; }

  /// Takes a tick. `is_touched`: an object is in contact. `interval_s` > 0 since the last tick.
  void update(const WatchedTick& now, bool is_touched, const hal::Vector3& velocity_mm_per_s,
              double interval_s) noexcept;

 private:
  /// Speed is judged over so long before a contact is declared: declaring one takes time.
  static constexpr double kApproachS = 0.03;

  /// A contact that is lost for less is the same one.
  static constexpr double kNewContactS = 0.05;

  void follow_contact(const WatchedTick& now, double interval_s) noexcept;

  WatchLimits limits_;
  hal::Vector3 axis_;
  double period_s_;
  bool is_running_ = false;
  PresentationSummary summary_;
  bool has_first_contact_ = false;
  hal::Vector3 first_contact_mm_;
  bool was_in_contact_ = false;
  double free_s_ = 0.0;             ///< out of contact
  hal::Vector3 last_contact_mm_;    ///< of the tick before, across the press axis
  double approach_mm_per_s_ = 0.0;  ///< the fastest of late
  double approach_age_s_ = 0.0;
};

}  // namespace hapticd::rt
