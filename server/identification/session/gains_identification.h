#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "hal/rig.h"
#include "server/identification/estimate/ultimate_oscillation.h"
#include "server/identification/gate/sample_gate.h"
#include "server/identification/session/identification_session.h"
#include "server/identification/session/tasks.h"

namespace hapticd::identification {

/// Controller gains by the method of Ziegler and Nichols (D§3.3.2): press after press on an object, Kp rises
/// by kStep with Kd = 0 until the tip keeps oscillating; then Kp = 0.6 K_c, Kd = Kp T_c / 8, tried in a last
/// press.
///
/// The controller with its observer is a lag of 1/Kp - 1 periods: gains that are too low oscillate as well.
/// The search passes through bands that oscillate as long as Kp < 1, where more gain still means less delay,
/// and keeps the widest range that holds; K_c is its upper end. It never asks for a gain outside the
/// controller's own stable region (Kp > 0, |Kd'| < 1, Kp + 2 Kd' < 2), and if no oscillation comes before
/// Kp = 2 it says so.
///
/// Safety: an oscillation is reported within a few cycles, one that grows earlier; from that tick on
/// request() asks for a free hand and no force, and requests should be carried out at once.
/// A force far beyond the hand's own means a target which this object does not admit: the search ends there.
/// A press under which the device is silent (it did not render yet, or a late tick ended the contact) is
/// asked for again, kMaxLostPresses - 1 times.
class GainsIdentification final : public IdentificationSession {
 public:
  GainsIdentification(const GainsTask& task, const hal::RigInfo& rig);

  void add(const rt::Observation& observation) override;
  MotionRequest next_request() const override;

  static constexpr double kFirstGain = 0.3;
  static constexpr double kStep = 1.15;
  static constexpr double kControllerLimit = 2.0;  ///< Kp with Kd = 0; never reached
  static constexpr double kLastGain = 1.95;
  static constexpr double kUltimateShare = 0.6;     ///< of K_c
  static constexpr double kPeriodShare = 0.125;     ///< Kd = share · Kp · T_c
  static constexpr double kDerivativeShare = 0.25;  ///< of what the stable region admits for Kd
  static constexpr double kPressN = 2.0;
  static constexpr int kMaxLostPresses = 3;  ///< in a row, in which the device was silent
  static constexpr double kRunAwayN = 8.0;   ///< of the device, under a press of kPressN
  static constexpr double kWatchS = 0.8;     ///< under force, before a gain is said to hold

 private:
  enum class Phase : std::uint8_t { kSearch, kConfirm, kVerify, kDone, kRefused };
  struct Trial {
    double gain = 0.0;
    double derivative_ms = 0.0;
    bool oscillates = false;
    double period_s = 0.0;
    double amplitude_mm = 0.0;
  };

  void find(IdentificationProgress& progress) const override;
  std::optional<hal::Error> conclude(const IdentificationProgress& now,
                                     rt::IdentifiedModel& model) const override;

  void end_trial(bool oscillates);
  void close_range(double end, double period_s);
  void go_on();
  void choose();
  void propose(double gain, double derivative_ms);
  double bounded_derivative_ms(double gain, double wanted_ms) const noexcept;
  void refuse(const std::string& why);

  GainsTask task_;
  hal::RigInfo rig_;
  SampleGate gate_;
  UltimateOscillation oscillation_;  ///< of the position, mm
  UltimateOscillation in_force_;     ///< of the device's force, N: a stiff object moves little
  Phase phase_ = Phase::kSearch;
  double gain_ = kFirstGain;
  double derivative_ms_ = 0.0;
  double range_from_ = 0.0;  ///< of gains that hold, under way; 0 = none
  double highest_holding_ = 0.0;
  double lowest_holding_ = 0.0;  ///< of the widest range; its end and how it swings there:
  double ultimate_ = 0.0;
  double period_s_ = 0.0;
  bool limit_first_ = false;
  bool verified_ = false;
  std::string refusal_;
  std::string remark_;

  bool backing_off_ = true;  ///< until the device is quiet and the hand free; so it begins, too
  bool pressed_ = false;
  bool acted_ = false;  ///< the device gave force since the press began
  double pressed_s_ = 0.0;
  double free_s_ = 0.0;
  double silent_s_ = 0.0;
  bool press_is_lost_ = false;  ///< the device was silent under it: not judged, the hand has to let go
  int lost_presses_ = 0;        ///< in a row
  hal::Vector3 axis_{0.0, 0.0, 1.0};
  std::vector<Trial> trials_;  ///< at most kMaxTrials

  static constexpr std::size_t kMaxTrials = 40;
  std::uint64_t used_ = 0;
  double first_s_ = 0.0, last_s_ = 0.0;
};

}  // namespace hapticd::identification
