#pragma once

#include <variant>

#include "rt/baseline/published_direction.h"
#include "rt/deformation/tracked_direction.h"

namespace hapticd::rt {

/// Method by which a scene finds the deformation direction.
class Direction {
 public:
  explicit Direction(const TrackedDirection& tracked) noexcept : path_(tracked) {}
  explicit Direction(const PublishedDirection& published) noexcept : path_(published) {}

  void begin(const hal::Vector3& reaction_n) noexcept {
    std::visit([&](auto& way) { way.begin(reaction_n); }, path_);
  }
  /// Takes, in the rig frame, the reaction on the tool, the motion of the tip since the last tick, `periods`
  /// ago, and its velocity.
  void update(const hal::Vector3& reaction_n, const hal::Vector3& step_mm,
              const hal::Vector3& velocity_mm_per_s, double periods = 1.0) noexcept {
    std::visit([&](auto& way) { way.update(reaction_n, step_mm, velocity_mm_per_s, periods); }, path_);
  }
  /// u^n, out of the object, length 1.
  const hal::Vector3& normal() const noexcept {
    return std::visit([](const auto& way) -> const hal::Vector3& { return way.normal(); }, path_);
  }
  /// Friction on the tool.
  const hal::Vector3& friction_n() const noexcept {
    return std::visit([](const auto& way) -> const hal::Vector3& { return way.friction_n(); }, path_);
  }

 private:
  std::variant<TrackedDirection, PublishedDirection> path_;
};

}  // namespace hapticd::rt
