#include "server/calibration/estimate/coverage.h"

#include <algorithm>
#include <cmath>
#include <functional>

#include "rt/arm/rigid_transform.h"

namespace hapticd::calibration {

namespace {

constexpr std::size_t kMaxPosesLookedAt = 1500;

double range_of(std::vector<double> values) {
  if (values.size() < 2) return 0.0;
  std::sort(values.begin(), values.end());
  const auto last = static_cast<double>(values.size() - 1);
  return values[static_cast<std::size_t>(0.98 * last)] - values[static_cast<std::size_t>(0.02 * last)];
}

void add_turns(const std::vector<ReferencePose>& reference, double required_deg,
               std::vector<CoverageItem>& items) {
  const ReferencePose* first = nullptr;
  std::array<std::vector<double>, 3> turns;
  const std::size_t stride = 1 + reference.size() / kMaxPosesLookedAt;
  for (std::size_t i = 0; i < reference.size(); i += stride) {
    const ReferencePose& p = reference[i];
    if (!p.orientation) continue;
    if (first == nullptr) first = &p;
    const Eigen::Vector3d turn =
        rt::kDegPerRad * rt::turn_of(first->orientation->conjugate() * *p.orientation);
    for (std::size_t k = 0; k < 3; ++k) turns[k].push_back(turn[static_cast<Eigen::Index>(k)]);
  }
  std::array<double, 3> ranges{range_of(turns[0]), range_of(turns[1]), range_of(turns[2])};
  std::sort(ranges.begin(), ranges.end(), std::greater<>());
  items.push_back(
      {"tool_turn_first", "°", ranges[0], required_deg, "lean the tool to the left and to the right"});
  items.push_back({"tool_turn_second", "°", ranges[1], required_deg, "lean the tool forward and back"});
}

}  // namespace

std::vector<CoverageItem> coverage_of(CalibrationKind kind, const RigStream& rig,
                                      const std::vector<ReferencePose>& reference) {
  std::vector<CoverageItem> items;
  if (kind == CalibrationKind::kTip) {
    items.push_back({"poses", "1", static_cast<double>(reference.size()), 300.0, "keep turning the tool"});
    add_turns(reference, 40.0, items);
  } else {
    const bool arm = kind == CalibrationKind::kKinematics;
    items.push_back(
        {"poses", "1", static_cast<double>(reference.size()), arm ? 1200.0 : 600.0, "keep moving"});
    std::array<std::vector<double>, 3> tip;
    std::array<std::vector<double>, 6> angles;
    double squares = 0.0;
    double count = 0.0;
    const std::size_t stride = 1 + rig.size() / kMaxPosesLookedAt;
    for (std::size_t i = 0; i < rig.size(); i += stride) {
      const RigPose& p = rig.poses()[i];
      for (std::size_t k = 0; k < 3; ++k) {
        tip[k].push_back(p.tip_mm[static_cast<Eigen::Index>(k)]);
        if (!p.angles.known) continue;
        angles[k].push_back(rt::kDegPerRad * p.angles.joint_rad[k]);
        angles[3 + k].push_back(rt::kDegPerRad * p.angles.gimbal_rad[k]);
      }
      if (const auto speed = rig.speed_mm_per_s(p.time_s)) {
        squares += *speed * *speed;
        count += 1.0;
      }
    }
    items.push_back({"speed", "mm/s", count > 0.0 ? std::sqrt(squares / count) : 0.0, 40.0,
                     "move quicker: the latency shows only in motion"});
    const std::array<const char*, 3> where{"to the left and to the right", "towards you and away",
                                           "up and down"};
    for (std::size_t k = 0; k < 3; ++k) {
      items.push_back({std::string("tip_range_") + "xyz"[k], "mm", range_of(tip[k]), 60.0,
                       std::string("move the tip ") + where[k] + ", as far as it goes"});
    }
    if (arm) {
      const std::array<double, 6> required{30.0, 20.0, 20.0, 40.0, 40.0, 40.0};
      const std::array<const char*, 6> how{"swing the arm to the left and to the right",
                                           "raise and lower the arm",
                                           "reach out and pull back",
                                           "turn the tool about the upright",
                                           "lean the tool forward and back",
                                           "lean the tool to the left and to the right"};
      for (std::size_t k = 0; k < 6; ++k) {
        const bool joint = k < 3;
        items.push_back({std::string(joint ? "joint_" : "gimbal_") + std::to_string(1 + k % 3) + "_range",
                         "°", range_of(angles[k]), required[k], how[k]});
      }
    }
  }
  std::stable_sort(items.begin(), items.end(), [](const CoverageItem& a, const CoverageItem& b) {
    return a.value / a.required < b.value / b.required;
  });
  return items;
}

double completion_of(const std::vector<CoverageItem>& items) {
  double sum = 0.0;
  for (const CoverageItem& item : items) sum += std::clamp(item.value / item.required, 0.0, 1.0);
  return items.empty() ? 0.0 : sum / static_cast<double>(items.size());
}

}  // namespace hapticd::calibration
