#include "tests/emulators/openhaptics/page.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cstdio>

#include "tests/support/system/monotonic_ns.h"

namespace hapticd::emulators {

HdPage::HdPage(const std::string& path)
    : SharedPage(path, [](HdPageLayout& layout) {
        const char* names[] = {"Default Device", "Second Device"};
        for (std::size_t index = 0; index < HdPageLayout::kDevices; ++index) {
          HdPageDevice& device = layout.devices[index];
          std::snprintf(device.name, sizeof device.name, "%s", names[index]);
          std::snprintf(device.model_type, sizeof device.model_type, "PHANTOM 1.5");
          device.max_force_n = 8.5;
          device.max_continuous_force_n = 1.4;
          device.max_stiffness_n_per_mm = 1.0;
          device.calibration_state = 0x5000;
          device.calibration_styles = 1 << 1;
          for (auto& share : device.motor_temperature) share = 0.2;
          for (const std::size_t diagonal : {0U, 5U, 10U, 15U}) device.transform[diagonal] = 1.0;
        }
      }) {}

void HdPage::set_pose(const hal::Vector3& position_mm, const hal::Quaternion& q, std::size_t index) noexcept {
  const Eigen::Isometry3d pose = Eigen::Translation3d(position_mm.x, position_mm.y, position_mm.z) *
                                 Eigen::Quaterniond(q.w, q.x, q.y, q.z);
  std::array<double, 16> transform;
  std::copy_n(pose.matrix().data(), transform.size(), transform.begin());  // column by column
  set_transform(transform, index);
}

void HdPage::set_angles(const std::array<double, 3>& joint_rad, const std::array<double, 3>& gimbal_rad,
                        std::size_t index) noexcept {
  HdPageDevice& device = layout().devices[index];
  for (std::size_t i = 0; i < 3; ++i) {
    device.angles_rad[i] = joint_rad[i];
    device.angles_rad[3 + i] = gimbal_rad[i];
  }
  device.has_angles = true;
}

void HdPage::set_transform(const std::array<double, 16>& transform, std::size_t index) noexcept {
  HdPageDevice& device = layout().devices[index];
  const std::uint32_t sequence = device.pose_sequence.load(std::memory_order_relaxed);
  device.pose_sequence.store(sequence + 1, std::memory_order_relaxed);
  // Each with release: the one who sees one of them also sees the odd number.
  for (std::size_t i = 0; i < transform.size(); ++i) {
    device.transform[i].store(transform[i], std::memory_order_release);
  }
  device.pose_sequence.store(sequence + 2, std::memory_order_release);
}

hal::Vector3 HdPage::force_n(std::size_t index) const noexcept {
  const HdPageDevice& device = layout().devices[index];
  if (!device.open || !device.force_enabled) return {};
  while (true) {
    const std::uint32_t before = device.force_sequence.load(std::memory_order_acquire);
    const hal::Vector3 force{device.force_n[0].load(std::memory_order_acquire),
                             device.force_n[1].load(std::memory_order_acquire),
                             device.force_n[2].load(std::memory_order_acquire)};
    const std::int64_t time_ns = device.force_time_ns.load(std::memory_order_acquire);
    if (before % 2 != 0 || device.force_sequence.load(std::memory_order_relaxed) != before) continue;
    return test::monotonic_ns() - time_ns > kWatchdogNs ? hal::Vector3{} : force;
  }
}

void HdPage::set_late_ticks(const std::vector<double>& late_us) noexcept {
  layout().late_ticks = 0;
  const std::size_t count = std::min(late_us.size(), HdPageLayout::kLateTicks);
  for (std::size_t i = 0; i < count; ++i) layout().late_us[i] = static_cast<float>(late_us[i]);
  layout().late_ticks = static_cast<std::uint32_t>(count);
}

std::vector<HdEvent> HdPage::events() const {
  std::vector<HdEvent> list;
  const std::uint32_t count = std::min<std::uint32_t>(layout().event_count, HdPageLayout::kEvents);
  for (std::uint32_t i = 0; i < count; ++i) list.push_back(static_cast<HdEvent>(layout().events[i].load()));
  return list;
}

}  // namespace hapticd::emulators
