#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "hal/turntable.h"
#include "hal/turntable/drive.h"
#include "hal/turntable/motion_supervisor.h"

namespace hapticd::turntable {

/// What the mechanics allow and how closely the drive is watched, whatever the drive.
struct TurntableSettings {
  double min_deg = -180.0;
  double max_deg = 180.0;
  double speed_deg_per_s = 90.0;
  double acceleration_deg_per_s2 = 180.0;
  SupervisionSettings supervision;
  double poll_hz = 30.0;
  double stale_after_s = 0.5;      ///< a position older than this counts as unknown
  double busy_timeout_s = 2.0;     ///< the same, and the limit for orders, while the drive answers "busy"
  double engage_timeout_s = 3.0;   ///< until the drive has reported its position
  double reconnect_after_s = 0.1;  ///< pause after the first failure; doubles with each further one
  double reconnect_longest_s = 5.0;
  std::vector<hal::TurntableStation> stations;
};

/// Checks the settings: an error if they contradict each other or themselves.
std::optional<hal::Error> check(const TurntableSettings& settings);

/// A turntable made of a drive: one thread that polls it, follows its motions, asks the permit and connects
/// again where contact was lost.
class DrivenTurntable final : public hal::Turntable {
 public:
  DrivenTurntable(std::string name, const TurntableSettings& settings, std::unique_ptr<Drive> drive);
  /// Disengages.
  ~DrivenTurntable() override;

  const hal::TurntableInfo& info() const noexcept override;
  std::optional<hal::Error> engage() override;
  void disengage() noexcept override;
  hal::TurntableStatus status() const override;
  hal::PartReport report() const override;
  void set_permit(hal::MotionPermit permit) override;
  hal::Result<std::uint64_t> home() override;
  hal::Result<std::uint64_t> move_to(double angle_deg, const hal::MotionLimits& limits) override;
  void stop() override;
  std::optional<hal::Error> clear_alarm() override;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace hapticd::turntable
