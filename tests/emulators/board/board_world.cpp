#include "tests/emulators/board/board_world.h"

#include <algorithm>
#include <cmath>

namespace hapticd::emulators {

namespace {

constexpr double kEndV = 10.0;
constexpr double kCodes = 65535.0;
constexpr std::uint32_t kCounterMask = (1U << 24U) - 1U;
constexpr double kTurnRad = 6.28318530717958647692;
// Nothing is at zero by itself.
constexpr std::array<double, 6> kGaugeOffsetV{0.4, -0.3, 0.2, -0.1, 0.35, -0.25};
constexpr std::array<std::int64_t, 6> kCounterStart{12345, -54321, 99, 7, -7, 70};

}  // namespace

BoardWorld::BoardWorld(const std::string& path, const ArmDescription& arm, double instrument_mm_per_v)
    : page_(path),
      arm_(arm),
      instrument_v_per_mm_(instrument_mm_per_v > 0.0 ? 1.0 / instrument_mm_per_v : 0.0) {
  load({}, {});
}

void BoardWorld::pose(const hal::Vector3& tip_mm, const hal::Quaternion& orientation) {
  if (has_home_ && !is_awake()) return;
  joints_rad_ = arm_.joints(tip_mm);
  gimbal_rad_ = arm_.gimbal(joints_rad_, orientation);
  if (has_home_) return;
  home_joints_rad_ = joints_rad_;
  home_gimbal_rad_ = gimbal_rad_;
  has_home_ = true;
}

void BoardWorld::load(const hal::Vector3& force_n, const hal::Vector3& torque_n_mm) {
  const std::array<double, 6> volts = gauges_.volts(force_n, torque_n_mm);
  for (std::size_t i = 0; i < volts.size(); ++i) inputs_v_[i] = volts[i] + kGaugeOffsetV[i];
}

void BoardWorld::instrument(const hal::Vector3& tip_mm) {
  const double mm[] = {tip_mm.x, tip_mm.y, tip_mm.z};
  for (std::size_t i = 0; i < 3; ++i) {
    inputs_v_[6 + i] = std::clamp(mm[i] * instrument_v_per_mm_, -kEndV, kEndV);
  }
}

hal::Vector3 BoardWorld::force_n() const {
  std::array<double, 3> volts{};
  for (std::size_t i = 0; i < 3; ++i) {
    volts[i] = 2.0 * kEndV * (static_cast<double>(page_->outputs[i].load()) - 32768.0) / kCodes;
  }
  return arm_.tip_force_n(joints_rad_, volts);
}

void BoardWorld::show() {
  std::array<std::uint32_t, BoardPageLayout::kCounters> counts{};
  const std::array<std::int64_t, 3> arm = arm_.counts(joints_rad_);
  for (std::size_t i = 0; i < 6; ++i) {
    const std::int64_t count =
        i < 3 ? arm[i] : std::llround(gimbal_rad_[i - 3] / kTurnRad * kGimbalCountsPerTurn);
    counts[i] = static_cast<std::uint32_t>(count + kCounterStart[i]) & kCounterMask;
  }
  page_.write_world(inputs_v_, counts);
}

}  // namespace hapticd::emulators
