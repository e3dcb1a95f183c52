#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>

#include "hal/rig.h"
#include "rt/contact/free_motion_residual.h"
#include "rt/signal/tool_load.h"
#include "server/identification/gate/sample_gate.h"
#include "server/identification/session/identification_session.h"
#include "server/identification/session/tasks.h"

namespace hapticd::identification {

/// ε_f of the contact detection: the smallest threshold without a false alarm in free motion (D§3.2.2), on
/// the residual that the detection itself listens to.
///
/// The largest residual seen says little beyond the time it was watched: in n seconds
/// free of alarms the next second raises one with probability 1/(n + 1), whatever the distribution. So the
/// greatest residual of each second is collected, apart for seconds of slow and of fast motion, and what
/// exceeds their upper quartile is taken to fall off exponentially (peaks over threshold, Pickands 1975); ε_f
/// is what the tail of the worst class exceeds once in kAlarmFreeS, or the largest residual seen, whichever
/// is greater. The result holds for motion no more violent than what was seen.
///
/// Nothing counts before the tool was free, at the beginning and after each gap: with less on it than a scene
/// may take for the sensor's zero, for as long as the filters remember.
///
/// Uses the tool's mass that the rig states, and needs a sensor that was biased with the tool upright.
class ThresholdIdentification final : public IdentificationSession {
 public:
  ThresholdIdentification(const ThresholdTask& task, const hal::RigInfo& rig);

  void add(const rt::Observation& observation) override;
  MotionRequest next_request() const override;

  /// Time of free motion for one false alarm expected, if all of it is as violent as the worst class: with
  /// use that strikes the air now and then this is hours.
  static constexpr double kAlarmFreeS = 600.0;

 private:
  static constexpr std::size_t kLevels =
      480;                                    ///< of greatest residuals, in equal ratios from 0.1 mN to 100 N
  static constexpr std::size_t kClasses = 4;  ///< of seconds, by the greatest speed in them

  struct Tail {
    double quartile_n = 0.0;
    double scale_n = 0.0;  ///< of the exponential beyond the upper quartile
    double level_n = 0.0;  ///< exceeded once in kAlarmFreeS
    double level_error_n = 0.0;
    std::array<std::uint32_t, kLevels> levels{};
    std::uint64_t seconds = 0;
    bool known = false;
  };
  void find(IdentificationProgress& progress) const override;
  std::optional<hal::Error> conclude(const IdentificationProgress& now,
                                     rt::IdentifiedModel& model) const override;
  std::size_t turn() const override;
  /// Tail of `levels`, which hold `seconds` seconds.
  static Tail tail_of(const std::array<std::uint32_t, kLevels>& levels, std::uint64_t seconds);
  /// Tail of the class of motion that asks for most; classes seen for a few seconds only count with the
  /// slower ones.
  Tail tail() const;
  void close_second();
  /// What keeps it waiting, in words; empty if nothing does.
  std::string wait() const;

  ThresholdTask task_;
  double tool_mass_g_;
  SampleGate gate_;
  rt::ToolLoad load_;
  rt::FreeMotionResidual3 residual_;
  hal::Vector3 last_position_mm_, velocity_mm_per_s_;
  double settled_s_ = 0.0;
  double held_n_ = 0.0;  ///< on the tool while it is not free; 0 if it is

  double second_s_ = 0.0;  ///< of the second under way
  double second_largest_n_ = 0.0;
  double observed_s_ = 0.0;
  double largest_n_ = 0.0;
  double largest_before_n_ = 0.0;  ///< the record that it broke
  double largest_at_s_ = 0.0;      ///< of observed time
  std::uint64_t seconds_ = 0;
  std::array<std::array<std::uint32_t, kLevels>, kClasses> levels_{};
  double second_top_speed_ = 0.0;
  double top_speed_mm_per_s_ = 0.0;
  std::optional<hal::Quaternion> first_orientation_;

  std::uint64_t used_ = 0;
};

}  // namespace hapticd::identification
