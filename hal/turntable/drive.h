#pragma once

#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "hal/error.h"
#include "hal/part_report.h"
#include "hal/turntable.h"

namespace hapticd::turntable {

/// What a drive says of itself, all at about the same time. What it cannot know is absent.
struct DriveReading {
  double position_deg = std::numeric_limits<double>::quiet_NaN();
  std::optional<double> velocity_deg_per_s;
  std::optional<bool> homed;
  std::optional<bool> moving;
  std::optional<bool> in_position;
  std::optional<bool> alarm;
  std::uint32_t alarm_code = 0;
};

/// A motor drive as the turntable's one thread knows it. Every call is bounded in time, none throws.
/// describe(), figures() and alarm_text() may be called from any thread.
class Drive {
 public:
  virtual ~Drive() = default;

  /// Opens the connection and sets the drive up for position mode.
  virtual std::optional<hal::Error> open() = 0;
  virtual void close() noexcept = 0;
  /// False once nothing more can be had from the connection: it has to be opened again.
  virtual bool linked() const noexcept = 0;

  virtual hal::Result<DriveReading> read() = 0;
  /// Starts a motion; both limits are given.
  virtual std::optional<hal::Error> start_move(double target_deg, const hal::MotionLimits& limits) = 0;
  virtual std::optional<hal::Error> start_home() = 0;
  virtual std::optional<hal::Error> stop() = 0;
  virtual std::optional<hal::Error> reset_alarm() = 0;

  /// Remedy after a reading whose position is implausible: how it would make sense, e.g. in another order of
  /// words. Empty when nothing fits.
  virtual std::string hint_for_implausible() const { return {}; }

  virtual std::string driver() const = 0;      ///< e.g. "modbus"
  virtual std::string connection() const = 0;  ///< e.g. "tcp 192.168.1.20:502, unit 1"
  virtual std::string alarm_text(std::uint32_t code) const = 0;
  virtual std::vector<hal::PartFigure> figures() const = 0;
};

}  // namespace hapticd::turntable
