#pragma once

#include <array>
#include <string>

#include "hal/samples.h"
#include "tests/emulators/board/arm_emulator.h"
#include "tests/emulators/board/board_page.h"
#include "tests/emulators/board/gauge_emulator.h"

namespace hapticd::emulators {

/// What is wired to a board behind a page: a force sensor's gauges (inputs 0 … 5), an instrument that sees
/// the tip along x, y and z (inputs 6 … 8), an arm with a gimbal (counters 0 … 5, outputs 0 … 2). From one
/// thread.
///
/// The arm is at rest in the pose it was shown first until the counters have been read often enough to be
/// homed there; what is shown until then is not.
class BoardWorld {
 public:
  static constexpr std::uint64_t kReadsToHome = 500;
  static constexpr double kGimbalCountsPerTurn = 4096.0;

  BoardWorld(const std::string& path, const ArmDescription& arm, double instrument_mm_per_v);

  void pose(const hal::Vector3& tip_mm, const hal::Quaternion& orientation);
  void load(const hal::Vector3& force_n, const hal::Vector3& torque_n_mm);
  void instrument(const hal::Vector3& tip_mm);
  /// What the motors make at the tip.
  hal::Vector3 force_n() const;
  /// Hands all that was shown since to the page.
  void show();

  /// Whether there has been time to home the arm.
  bool is_awake() const { return page_->counter_reads.load() > kReadsToHome; }
  const std::array<double, 3>& home_joints_rad() const { return home_joints_rad_; }
  const std::array<double, 3>& home_gimbal_rad() const { return home_gimbal_rad_; }
  const std::string& path() const { return page_.path(); }
  const GaugeEmulator& gauges() const { return gauges_; }

 private:
  BoardPage page_;
  ArmEmulator arm_;
  GaugeEmulator gauges_;
  double instrument_v_per_mm_;
  bool has_home_ = false;
  std::array<double, 3> home_joints_rad_{}, home_gimbal_rad_{};
  std::array<double, 3> joints_rad_{}, gimbal_rad_{};
  std::array<double, BoardPageLayout::kInputs> inputs_v_{};
};

}  // namespace hapticd::emulators
