#include "hal/skeleton/skeleton_device.h"

#include <pthread.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <string>
#include <utility>

namespace hapticd::skeleton {

namespace {

constexpr double kMinWatchdogMs = 2.0;
constexpr double kMaxWatchdogMs = 1000.0;
/// The guard bounds the force to info().max_force_n; its rounding is not the device's excess.
constexpr double kForceTolerance = 1.001;

std::int64_t now_ns() noexcept {
  return std::chrono::steady_clock::now().time_since_epoch() / std::chrono::nanoseconds(1);
}

bool is_finite(const hal::Vector3& v) noexcept {
  return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z);
}

}  // namespace

hal::Result<std::unique_ptr<SkeletonDevice>> SkeletonDevice::create(const hal::DeviceInfo& info,
                                                                    double watchdog_ms,
                                                                    std::unique_ptr<DeviceLink> link) {
  if (!(info.max_force_n > 0.0)) {
    return hal::Error{.what = "the device gives no force",
                      .where = "[rig.skeleton] max_force_n",
                      .value = std::to_string(info.max_force_n),
                      .limit = "more than 0 N",
                      .remedy = "take it from the device's data sheet",
                      .code = hal::ErrorCode::kOutOfRange};
  }
  if (!(watchdog_ms >= kMinWatchdogMs && watchdog_ms <= kMaxWatchdogMs)) {
    return hal::Error{.what = "out of range",
                      .where = "[rig.skeleton] watchdog_ms",
                      .value = std::to_string(watchdog_ms),
                      .limit = "2 … 1000 ms",
                      .remedy = "20 ms suit a loop of 1 kHz",
                      .code = hal::ErrorCode::kOutOfRange};
  }
  return std::unique_ptr<SkeletonDevice>(new SkeletonDevice(info, watchdog_ms, std::move(link)));
}

SkeletonDevice::SkeletonDevice(const hal::DeviceInfo& info, double watchdog_ms,
                               std::unique_ptr<DeviceLink> link)
    : info_(info), watchdog_ns_(std::llround(1e6 * watchdog_ms)), link_(std::move(link)) {}

SkeletonDevice::~SkeletonDevice() {
  disengage();
}

std::optional<hal::Error> SkeletonDevice::engage() {
  if (engaged_) return std::nullopt;
  if (!link_->open()) {
    return hal::Error{.what = "no device answers",
                      .where = "haptic device",
                      .value = info_.model,
                      .limit = "",
                      .remedy = "check its cable and its supply"};
  }
  link_->write_force({});
  faulty_ = false;
  written_ = true;
  cut_ = false;
  last_command_ns_ = 0;
  engaged_ = true;
  watchdog_ = std::thread([this] { watch(); });
  return std::nullopt;
}

void SkeletonDevice::disengage() noexcept {
  if (!engaged_.exchange(false)) return;
  watchdog_.join();
  link_->write_force({});
  link_->close();
}

hal::PartReport SkeletonDevice::report() const {
  hal::PartReport report;
  report.part = "haptic device";
  report.driver = "skeleton";
  report.state = hal::PartState::kIdle;
  if (engaged_) report.state = faulty_ ? hal::PartState::kFaulty : hal::PartState::kReady;
  if (engaged_ && faulty_) report.findings = {"the device does not answer: check its cable and its supply"};
  return report;
}

void SkeletonDevice::read(hal::RigSample& sample) noexcept {
  hal::Vector3 position_mm;
  if (!engaged_) {
    sample.status |= hal::sample_status::kDeviceNotReady;
  } else {
    const bool answered = link_->read_position(position_mm) && is_finite(position_mm);
    if (answered) last_position_mm_ = position_mm;
    faulty_ = !answered || !written_;
    if (faulty_) sample.status |= hal::sample_status::kDeviceFault;
    if (over_force_.exchange(false)) sample.status |= hal::sample_status::kDeviceOverForce;
    if (cut_.exchange(false)) sample.status |= hal::sample_status::kCommandStale;
  }
  sample.tip_position_mm = last_position_mm_;
}

void SkeletonDevice::write(const hal::DeviceCommand& command) noexcept {
  if (!engaged_) return;
  hal::Vector3 force_n = command.force_n;
  const double magnitude_n = std::sqrt(dot(force_n, force_n));
  if (!std::isfinite(magnitude_n) || faulty_ || cut_ || crashed_) {
    force_n = {};
  } else if (magnitude_n > kForceTolerance * info_.max_force_n) {
    force_n = force_n * (info_.max_force_n / magnitude_n);
    over_force_ = true;
  }
  last_command_ns_ = now_ns();
  written_ = link_->write_force(force_n);
}

void SkeletonDevice::write_zero_in_crash() noexcept {
  crashed_ = true;
  if (engaged_) link_->write_force({});
}

// Runs on its own thread, because the loop that should send commands may be the one that hangs.
void SkeletonDevice::watch() noexcept {
  pthread_setname_np(pthread_self(), "skeleton-cut");
  const std::chrono::nanoseconds poll_interval(std::min<std::int64_t>(watchdog_ns_ / 4, 5'000'000));
  while (engaged_) {
    std::this_thread::sleep_for(poll_interval);
    const std::int64_t last_ns = last_command_ns_;
    if (last_ns == 0 || now_ns() - last_ns <= watchdog_ns_) continue;
    cut_ = true;
    last_command_ns_ = 0;
    link_->write_force({});
  }
}

}  // namespace hapticd::skeleton
