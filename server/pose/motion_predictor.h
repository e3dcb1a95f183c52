#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>

#include "server/pose/tip_motion.h"

namespace hapticd::pose {

/// A pose that was predicted, in the rig's frame, and how wrong it may be.
struct PredictedMotion {
  Eigen::Vector3d position_mm = Eigen::Vector3d::Zero();
  Eigen::Quaterniond orientation = Eigen::Quaterniond::Identity();
  /// What the tip may do instead, and the noise of its velocity.
  Eigen::Matrix3d covariance_mm2 = Eigen::Matrix3d::Zero();
  double error_mm = 0.0;        ///< root of the trace of it
  double error_bound_mm = 0.0;  ///< while the tip accelerates by no more than kAssumedMmPerS2
  double error_rad = 0.0;       ///< standard deviation of the direction, all three axes together
  bool normal_is_held = false;
};

/// Predicts where the tip will be: state of order 1, its velocity stays constant. In contact it stays where
/// it is along the surface's normal and goes on across it: an object stops a tip that a constant velocity
/// would send through.
///
///   p(t + τ) = p + (v - n n·v) τ,  q(t + τ) = exp(ω τ) q
///
/// The error is what the predictor finds itself: every kScoreEveryS it predicts kScoreAheadS ahead, and looks
/// later how far it was off. As an acceleration that stays constant would leave ½ a τ² + a L τ, L the lag of
/// the velocity, the mean square of e/(½τ² + Lτ) over the last kMemoryS is that of the acceleration, as a
/// matrix: a hand that goes back and forth along a line is uncertain along it. Any other τ is scaled from
/// there.
class MotionPredictor {
 public:
  /// Fast voluntary motions of a hand reach this [approximate]; an impact exceeds it.
  static constexpr double kAssumedMmPerS2 = 10e3;
  static constexpr double kMaxAheadS = 0.1;

  /// `resolution_mm`: of the encoders, for the noise of the velocity.
  explicit MotionPredictor(double resolution_mm) noexcept;

  struct Now {
    std::int64_t time_ns = 0;  ///< of the encoders' reading
    Eigen::Vector3d position_mm = Eigen::Vector3d::Zero();
    Eigen::Quaterniond orientation = Eigen::Quaterniond::Identity();
    Eigen::Vector3d angular_rad_per_s = Eigen::Vector3d::Zero();
    std::optional<Eigen::Vector3d> normal;  ///< of length 1, in contact only
  };
  void follow(const Now& now) noexcept;

  /// Motion ahead of the last `now`; `ahead_s` 0 … kMaxAheadS. With 0: the pose as it is, and no error.
  PredictedMotion ahead(double ahead_s) const noexcept;
  const TipMotion& path() const noexcept { return path_; }
  Eigen::Vector3d velocity_mm_per_s() const noexcept { return path_.velocity().mm_per_s; }

 private:
  static constexpr double kScoreAheadS = 0.05;
  static constexpr double kScoreEveryS = 0.005;
  static constexpr double kMemoryS = 0.5;
  static constexpr double kAngularLagS = 0.020;  ///< of the angular velocity that is followed
  /// What is assumed before there is a score: a slow hand.
  static constexpr double kPriorMmPerS2 = 500.0;
  static constexpr double kPriorRadPerS2 = 5.0;

  struct Guess {
    std::int64_t due_ns = 0;
    double ahead_s = 0.0;
    double lag_s = 0.0;
    Eigen::Vector3d position_mm = Eigen::Vector3d::Zero();
    Eigen::Quaterniond orientation = Eigen::Quaterniond::Identity();
  };
  void restart() noexcept;
  void score(const Now& now) noexcept;
  void guess() noexcept;

  double position_noise_mm_;
  TipMotion path_;
  Now now_;
  bool begun_ = false;
  std::array<Guess, 16> guesses_{};
  std::size_t first_ = 0;
  std::size_t waiting_ = 0;
  std::int64_t next_guess_ns_ = 0;
  std::int64_t last_score_ns_ = 0;
  Eigen::Matrix3d acceleration_ = Eigen::Matrix3d::Zero();  ///< mean of a aᵀ, (mm/s²)²
  double angular_acceleration_ = 0.0;                       ///< mean of its square, (rad/s²)²
};

}  // namespace hapticd::pose
