#pragma once

#include <array>
#include <cstdint>

#include "hal/phantom/kinematics.h"

namespace hapticd::phantom {

/// Whether what the encoders say can be the motion of an arm. A joint faster than any arm is an encoder that
/// has jumped: from then on its counts mean nothing, until the arm is homed again. (An encoder that is stuck
/// cannot be told from an arm at rest.)
class MotionCheck {
 public:
  MotionCheck(double max_joint_speed_rad_per_s, const std::array<double, 3>& rad_per_count,
              double max_speed_mm_per_s) noexcept
      : max_joint_speed_rad_per_s_(max_joint_speed_rad_per_s),
        rad_per_count_(rad_per_count),
        max_speed_mm_per_s_(max_speed_mm_per_s) {}

  void restart() noexcept;

  /// False when a joint cannot have moved so far since the last call; jumped_joint() is then its index.
  bool plausible(const JointAngles& q, std::int64_t now_ns) noexcept;
  int jumped_joint() const noexcept { return jumped_joint_; }

  /// Speed of the tip over at least two milliseconds, so that one count does not look like a high speed.
  void follow(const hal::Vector3& tip_mm, std::int64_t now_ns) noexcept;
  bool over_speed() const noexcept { return over_speed_; }

 private:
  double max_joint_speed_rad_per_s_;
  std::array<double, 3> rad_per_count_;
  double max_speed_mm_per_s_;

  bool has_joints_ = false;
  JointAngles last_q_rad_{};
  std::int64_t last_ns_ = 0;
  int jumped_joint_ = -1;

  bool has_tip_ = false;
  hal::Vector3 reference_mm_;
  std::int64_t reference_ns_ = 0;
  bool over_speed_ = false;
};

}  // namespace hapticd::phantom
