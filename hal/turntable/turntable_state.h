#pragma once

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <utility>

#include "hal/lock/mutex.h"
#include "hal/turntable/driven_turntable.h"
#include "hal/turntable/motion_supervisor.h"

namespace hapticd::turntable {

std::string number(double value, const char* unit);
/// Range from the least to the largest angle.
std::string range_text(const TurntableSettings& settings);
inline hal::Error not_engaged() {
  return {"the turntable is not engaged", "turntable", "", "", "engage it first"};
}

/// The table's thread, and what it shares with others.
struct DrivenTurntable::State {
  using Clock = std::chrono::steady_clock;
  using MotionEnd = hal::MotionEnd;
  using TurntableState = hal::TurntableState;

  State(std::string name, const TurntableSettings& given, std::unique_ptr<Drive> its_drive);

  // -- set once
  const TurntableSettings settings;
  const hal::TurntableInfo info;
  const Clock::time_point epoch = Clock::now();

  // -- of the table's thread alone, while it runs
  const std::unique_ptr<Drive> drive;
  MotionSupervisor supervisor;
  int failures_in_a_row = 0;
  double pause_s = 0.0;
  Clock::time_point next_attempt{};
  Clock::time_point next_poll{};
  std::optional<DriveReading> last_reading;
  double last_reading_s = 0.0;
  bool safety_stop_sent = false;
  bool stop_is_due = false;  ///< the drive has not taken a stop: it is repeated at every poll

  // -- the thread itself
  SerialMutex engage_mutex;  ///< makes engaging and disengaging one after the other
  std::thread thread GUARDED_BY(engage_mutex);

  // -- shared, under the mutex
  mutable Mutex mutex;
  Condition wake;     ///< to the table's thread
  Condition changed;  ///< from it
  hal::MotionPermit permit GUARDED_BY(mutex);
  bool leave GUARDED_BY(mutex) = false;
  struct Orders {
    bool stop = false;
    bool clear = false;
    bool home = false;
    std::optional<std::pair<double, hal::MotionLimits>> move;
    bool any() const { return stop || clear || home || move; }
  };
  struct RepeatedOrder {
    Orders order;
    double since_s = 0.0;
  };
  std::optional<RepeatedOrder> repeated;  ///< by the table's thread: the drive was too busy to take it
  Orders orders GUARDED_BY(mutex);
  bool engaged GUARDED_BY(mutex) = false;
  bool reported_once GUARDED_BY(mutex) = false;  ///< a position since it was engaged
  bool stalled GUARDED_BY(mutex) = false;
  TurntableState drive_state GUARDED_BY(mutex) = TurntableState::kNotHomed;  ///< while the position is fresh
  DriveReading reading GUARDED_BY(mutex);
  double velocity_deg_per_s GUARDED_BY(mutex) = 0.0;
  double reading_s GUARDED_BY(mutex) = 0.0;
  hal::MotionReport motion GUARDED_BY(mutex);
  std::uint64_t ordered GUARDED_BY(mutex) = 0;              ///< number of the last motion that was asked for
  bool is_busy GUARDED_BY(mutex) = false;                   ///< the drive's last answer
  std::optional<hal::Error> link_error GUARDED_BY(mutex);   ///< why there is no usable answer now
  std::optional<hal::Error> order_error GUARDED_BY(mutex);  ///< of the last order that was not taken
  std::uint64_t polls GUARDED_BY(mutex) = 0;
  std::uint64_t failures GUARDED_BY(mutex) = 0;
  std::uint64_t connects GUARDED_BY(mutex) = 0;
  std::uint64_t rejected GUARDED_BY(mutex) = 0;

  double now_s() const { return std::chrono::duration<double>(Clock::now() - epoch).count(); }

  // ---- the table's thread -------------------------------------------------------------------------------

  void run();

  Clock::duration period() const {
    return std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(1.0 / settings.poll_hz));
  }

  Clock::time_point wake_time() const;

  void lose_link(const hal::Error& why);

  void connect();

  void poll();

  std::optional<hal::Error> implausible(const DriveReading& candidate, double now) const;

  double velocity_of(const DriveReading& next, double now) const EXCLUDES(mutex);

  void accept(const DriveReading& next, double now);

  void send_stop();

  /// Gives the drive one order; a drive that is too busy gets it again at the next polls.
  void send(const Orders& order, double since_s);

  void repeat_orders();

  void stop_motion(MotionEnd how, std::optional<hal::Error> why) {
    if (supervisor.stop(now_s(), how, std::move(why)) == MotionSupervisor::Action::kSendStop) send_stop();
  }

  void ask_permit() {
    if (!supervisor.under_way() || supervisor.stopping()) return;
    if (auto why_not = permitted()) stop_motion(MotionEnd::kForbidden, std::move(why_not));
  }

  std::optional<hal::Error> permitted();

  void watch_age();

  void refuse(const hal::Error& why);

  void perform(const Orders& wanted);

  void begin(const Orders& wanted);

  TurntableState state_of(const DriveReading& now) const REQUIRES(mutex);

  void publish();

  // ---- any thread ---------------------------------------------------------------------------------------

  double age_locked() const REQUIRES(mutex) {
    return reported_once ? now_s() - reading_s : std::numeric_limits<double>::infinity();
  }

  double age_limit_locked() const REQUIRES(mutex) {
    return is_busy ? std::max(settings.stale_after_s, settings.busy_timeout_s) : settings.stale_after_s;
  }

  TurntableState state_locked() const REQUIRES(mutex);

  bool busy_locked() const REQUIRES(mutex) {
    return motion.end == MotionEnd::kUnderWay || motion.number < ordered;
  }

  /// Reason why no motion can begin now.
  std::optional<hal::Error> refusal_locked(bool needs_homed) const REQUIRES(mutex);

  hal::Result<std::uint64_t> order(bool needs_homed,
                                   std::optional<std::pair<double, hal::MotionLimits>> move);
};

}  // namespace hapticd::turntable
