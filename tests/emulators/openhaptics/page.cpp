#include "tests/emulators/openhaptics/page.h"

#include <fcntl.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <time.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <cstring>
#include <new>
#include <stdexcept>

namespace hapticd::emulators {

namespace {

std::int64_t monotonic_ns() noexcept {
  timespec now{};
  clock_gettime(CLOCK_MONOTONIC, &now);
  return std::int64_t{1'000'000'000} * now.tv_sec + now.tv_nsec;
}

}  // namespace

HdPage::HdPage(const std::string& path) : path_(path) {
  const int file = open(path.c_str(), O_RDWR | O_CREAT | O_TRUNC | O_CLOEXEC, 0600);
  if (file < 0 || ftruncate(file, sizeof(HdPageLayout)) != 0) {
    throw std::runtime_error("cannot make the page " + path + ": " + std::strerror(errno));
  }
  map(file);
  new (layout_) HdPageLayout();  // all zero
  const char* names[] = {"Default Device", "Second Device"};
  for (std::size_t index = 0; index < HdPageLayout::kDevices; ++index) {
    HdPageDevice& device = layout_->devices[index];
    std::snprintf(device.name, sizeof device.name, "%s", names[index]);
    std::snprintf(device.model_type, sizeof device.model_type, "PHANTOM 1.5");
    device.max_force_n = 8.5;
    device.max_continuous_force_n = 1.4;
    device.max_stiffness_n_per_mm = 1.0;
    device.calibration_state = 0x5000;
    device.calibration_styles = 1 << 1;
    for (auto& share : device.motor_temperature) share = 0.2;
    set_pose({}, {}, index);
  }
  layout_->magic = HdPageLayout::kMagic;
}

HdPage::HdPage(const std::string& path, Join) : path_(path) {
  const int file = open(path.c_str(), O_RDWR | O_CLOEXEC);
  struct stat state {};
  if (file < 0 || fstat(file, &state) != 0 || state.st_size != sizeof(HdPageLayout)) {
    throw std::runtime_error(path + " is not a page");
  }
  map(file);
  if (layout_->magic != HdPageLayout::kMagic) throw std::runtime_error(path + " is not a page");
}

void HdPage::map(int file) {
  void* memory = mmap(nullptr, sizeof(HdPageLayout), PROT_READ | PROT_WRITE, MAP_SHARED, file, 0);
  close(file);
  if (memory == MAP_FAILED) throw std::runtime_error("cannot map the page " + path_);
  layout_ = static_cast<HdPageLayout*>(memory);
}

HdPage::~HdPage() {
  munmap(layout_, sizeof(HdPageLayout));
}

void HdPage::set_pose(const hal::Vector3& position_mm, const hal::Quaternion& q, std::size_t index) noexcept {
  set_transform({1.0 - 2.0 * (q.y * q.y + q.z * q.z), 2.0 * (q.x * q.y + q.w * q.z),
                 2.0 * (q.x * q.z - q.w * q.y), 0.0,  //
                 2.0 * (q.x * q.y - q.w * q.z), 1.0 - 2.0 * (q.x * q.x + q.z * q.z),
                 2.0 * (q.y * q.z + q.w * q.x), 0.0,  //
                 2.0 * (q.x * q.z + q.w * q.y), 2.0 * (q.y * q.z - q.w * q.x),
                 1.0 - 2.0 * (q.x * q.x + q.y * q.y), 0.0,  //
                 position_mm.x, position_mm.y, position_mm.z, 1.0},
                index);
}

void HdPage::set_angles(const std::array<double, 3>& joint_rad, const std::array<double, 3>& gimbal_rad,
                        std::size_t index) noexcept {
  HdPageDevice& device = layout_->devices[index];
  for (std::size_t i = 0; i < 3; ++i) {
    device.angles_rad[i] = joint_rad[i];
    device.angles_rad[3 + i] = gimbal_rad[i];
  }
  device.has_angles = true;
}

void HdPage::set_transform(const std::array<double, 16>& transform, std::size_t index) noexcept {
  HdPageDevice& device = layout_->devices[index];
  const std::uint32_t sequence = device.pose_sequence.load(std::memory_order_relaxed);
  device.pose_sequence.store(sequence + 1, std::memory_order_relaxed);
  // Each with release: the one who sees one of them also sees the odd number.
  for (std::size_t i = 0; i < transform.size(); ++i) {
    device.transform[i].store(transform[i], std::memory_order_release);
  }
  device.pose_sequence.store(sequence + 2, std::memory_order_release);
}

hal::Vector3 HdPage::force_n(std::size_t index) const noexcept {
  const HdPageDevice& device = layout_->devices[index];
  if (!device.open || !device.force_enabled) return {};
  while (true) {
    const std::uint32_t before = device.force_sequence.load(std::memory_order_acquire);
    const hal::Vector3 force{device.force_n[0].load(std::memory_order_acquire),
                             device.force_n[1].load(std::memory_order_acquire),
                             device.force_n[2].load(std::memory_order_acquire)};
    const std::int64_t time_ns = device.force_time_ns.load(std::memory_order_acquire);
    if (before % 2 != 0 || device.force_sequence.load(std::memory_order_relaxed) != before) continue;
    return monotonic_ns() - time_ns > kWatchdogNs ? hal::Vector3{} : force;
  }
}

void HdPage::set_late_ticks(const std::vector<double>& late_us) noexcept {
  layout_->late_ticks = 0;
  const std::size_t count = std::min(late_us.size(), HdPageLayout::kLateTicks);
  for (std::size_t i = 0; i < count; ++i) layout_->late_us[i] = static_cast<float>(late_us[i]);
  layout_->late_ticks = static_cast<std::uint32_t>(count);
}

std::vector<HdEvent> HdPage::events() const {
  std::vector<HdEvent> list;
  const std::uint32_t count = std::min<std::uint32_t>(layout_->event_count, HdPageLayout::kEvents);
  for (std::uint32_t i = 0; i < count; ++i) list.push_back(static_cast<HdEvent>(layout_->events[i].load()));
  return list;
}

}  // namespace hapticd::emulators
