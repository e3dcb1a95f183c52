#include "server/rig/stillness_monitor.h"

#include <pthread.h>

#include <fmt/format.h>

#include <algorithm>
#include <chrono>

#include "rt/signal/vector.h"
#include "server/telemetry/telemetry_hub.h"

namespace hapticd::server {

namespace {

constexpr std::chrono::milliseconds kSamplePeriod{1};
constexpr int kSamplesPerMean = 50;

/// The largest distance between two of the points so far, axis by axis.
class Extent {
 public:
  void add(const hal::Vector3& point) {
    if (is_empty_) low_ = high_ = point;
    is_empty_ = false;
    low_ = {std::min(low_.x, point.x), std::min(low_.y, point.y), std::min(low_.z, point.z)};
    high_ = {std::max(high_.x, point.x), std::max(high_.y, point.y), std::max(high_.z, point.z)};
  }
  double size() const { return rt::norm(high_ - low_); }

 private:
  bool is_empty_ = true;
  hal::Vector3 low_;
  hal::Vector3 high_;
};

}  // namespace

StillnessMonitor::StillnessMonitor(TelemetryHub& hub) : hub_(hub), thread_([this] { run(); }) {}

StillnessMonitor::~StillnessMonitor() {
  ends_.store(true);
  thread_.join();
}

void StillnessMonitor::run() {
  pthread_setname_np(pthread_self(), "stillness");
  constexpr std::uint32_t kUnread = hal::sample_status::kForceMissing | hal::sample_status::kForceLost;
  Extent forces;
  Extent places;
  hal::Vector3 sum_n;
  int count = 0;
  std::uint64_t last_tick = 0;
  std::optional<std::uint32_t> zero;
  while (!ends_.load()) {
    const rt::TickRecord now = hub_.latest();
    if (now.tick != last_tick && (now.sample_status & kUnread) == 0) {
      last_tick = now.tick;
      places.add(now.tip_position_mm);
      if (zero != now.bias_serial) {  // what it reads under another zero is not to be compared
        zero = now.bias_serial;
        forces = {};
        sum_n = {};
        count = 0;
      }
      sum_n = sum_n + now.sensor_force_n;
      if (++count == kSamplesPerMean) {
        forces.add(sum_n * (1.0 / kSamplesPerMean));
        sum_n = {};
        count = 0;
      }
      force_change_n_.store(std::max(force_change_n_.load(), forces.size()));
      travel_mm_.store(places.size());
    }
    std::this_thread::sleep_for(kSamplePeriod);
  }
}

std::optional<hal::Error> StillnessMonitor::disturbance() const {
  const auto moved = [](const char* what, double value, double limit, const char* unit) {
    return hal::Error{what, "force sensor", fmt::format("{:.2g} {}", value, unit),
                      fmt::format("{:.2g} {}", limit, unit),
                      "hold the tool free of any object and at rest for a second, then bias again"};
  };
  if (const double n = force_change_n_.load(); n > kMaxForceChangeN) {
    return moved("the force changed while the bias was taken", n, kMaxForceChangeN, "N");
  }
  if (const double mm = travel_mm_.load(); mm > kMaxTravelMm) {
    return moved("the tool moved while the bias was taken", mm, kMaxTravelMm, "mm");
  }
  return std::nullopt;
}

}  // namespace hapticd::server
