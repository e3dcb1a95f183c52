#pragma once

#include <cstdint>
#include <optional>

#include "hal/error.h"
#include "hal/turntable.h"
#include "hal/turntable/drive.h"

namespace hapticd::turntable {

/// Rules by which a motion counts as arrived, late, stuck or at rest.
struct SupervisionSettings {
  double tolerance_deg = 0.2;        ///< between target and the drive's own position
  double settle_s = 0.1;             ///< time it has to rest there
  double stall_after_s = 0.75;       ///< without progress, beyond what the slowest start explains
  double stall_distance_deg = 0.05;  ///< what counts as progress
  double arrival_margin_s = 2.0;     ///< beyond one and a half times the trapezoid's duration
  double homing_timeout_s = 60.0;
  double stop_timeout_s = 3.0;  ///< time in which a table that was asked to stop has to be at rest
};

/// Follows one motion of the drive from its order to its end: a function of time and readings, without clock,
/// thread or wire.
class MotionSupervisor {
 public:
  /// What has to be done to the drive now.
  enum class Action : std::uint8_t { kNone, kSendStop };

  explicit MotionSupervisor(const SupervisionSettings& settings) : settings_(settings) {}

  /// Begins a motion; both limits are given; the order itself has been sent or is about to be.
  void begin_move(double now_s, double from_deg, double target_deg, const hal::MotionLimits& limits);
  void begin_home(double now_s, double from_deg);

  /// Takes a fresh reading.
  Action observe(double now_s, const DriveReading& reading);
  /// Ends the motion early: the drive is to stop, and once it is at rest the motion has ended so.
  Action stop(double now_s, hal::MotionEnd end, std::optional<hal::Error> problem);
  /// Postpones the motion: the drive has not taken the order yet, and its time begins now.
  void postpone(double now_s) noexcept { began_s_ = progress_s_ = rest_s_ = now_s; }
  /// Takes what the drive answered to the stop; nothing = it has taken it.
  void stop_answered(double now_s, std::optional<hal::Error> refusal);
  /// Ends the motion here and now.
  void abandon(double now_s, hal::MotionEnd end, hal::Error problem);

  bool under_way() const noexcept { return report_.end == hal::MotionEnd::kUnderWay; }
  bool stopping() const noexcept { return report_.stopping; }
  const hal::MotionReport& report() const noexcept { return report_; }

 private:
  void begin(double now_s, double from_deg, hal::MotionKind kind);
  void end(double now_s, hal::MotionEnd end);
  bool stands(double now_s, const DriveReading& reading) const noexcept;
  Action observe_move(double now_s, const DriveReading& reading);
  Action observe_home(double now_s, const DriveReading& reading);
  Action observe_stopping(double now_s, const DriveReading& reading);

  SupervisionSettings settings_;
  hal::MotionReport report_;
  double began_s_ = 0.0;
  double from_deg_ = 0.0;
  double timeout_s_ = 0.0;
  double stall_window_s_ = 0.0;
  double stop_sent_s_ = 0.0;
  std::optional<hal::Error> stop_refusal_;  ///< why the drive has not taken the stop
  hal::MotionEnd stop_end_ = hal::MotionEnd::kStopped;
  double progress_deg_ = 0.0;  ///< where progress was last seen
  double progress_s_ = 0.0;    ///< and when
  double rest_deg_ = 0.0;      ///< where it was last seen to move from
  double rest_s_ = 0.0;
  std::optional<double> settling_since_s_;
  bool home_seen_to_begin_ = false;
};

}  // namespace hapticd::turntable
