#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>

namespace hapticd::pose {

/// The last tenth of a second of a point's path, and how fast the point goes. Positions that follow sooner
/// than 0.8 ms after the one kept before are left out; a gap of more than 50 ms, or time that runs backwards,
/// begins it again.
class TipMotion {
 public:
  static constexpr double kWindowS = 0.012;  ///< of which the velocity is the mean
  static constexpr double kMaxGapS = 0.05;

  /// Follows a position; finite numbers only, others are left out.
  void follow(const Eigen::Vector3d& position_mm, std::int64_t time_ns) noexcept;
  void forget() noexcept { count_ = 0; }

  struct Velocity {
    Eigen::Vector3d mm_per_s = Eigen::Vector3d::Zero();
    double lag_s = 0.0;  ///< of what instant before the newest position it is
    /// Noise of each component, per mm of standard deviation of a position: 1/s.
    double noise_per_mm = 0.0;
    bool known = false;  ///< false: fewer than three positions; then it is zero
  };
  /// Slope of the least-squares line through the positions of the last kWindowS.
  Velocity velocity() const noexcept;

  /// Position at an instant within the path kept, linear between two. Nothing outside.
  std::optional<Eigen::Vector3d> position_mm(std::int64_t time_ns) const noexcept;

 private:
  static constexpr std::int64_t kMinStepNs = 800'000;
  static constexpr std::size_t kKept = 128;

  struct Moment {
    Eigen::Vector3d mm = Eigen::Vector3d::Zero();
    std::int64_t ns = 0;
  };
  const Moment& before(std::size_t age) const noexcept { return ring_[(newest_ + kKept - age) % kKept]; }

  std::array<Moment, kKept> ring_{};
  std::size_t newest_ = 0;
  std::size_t count_ = 0;
};

}  // namespace hapticd::pose
