#include "hal/composed_rig.h"

#include <cstdint>
#include <limits>
#include <thread>
#include <utility>

namespace hapticd::hal {

namespace {

constexpr std::uint32_t kOfForce = sample_status::kForceMissing | sample_status::kForceSaturated |
                                   sample_status::kForceFault | sample_status::kForceLost |
                                   sample_status::kForceWarning;

std::int64_t nanoseconds(std::chrono::steady_clock::duration duration) noexcept {
  return std::chrono::duration_cast<std::chrono::nanoseconds>(duration).count();
}

RigInfo describe(const RigParts& parts, double rate_hz) {
  RigInfo info;
  if (parts.base) info = parts.base->info();
  info.kind = RigKind::kHardware;
  info.rate_hz = rate_hz;
  info.renders_force = parts.device != nullptr || (parts.base && parts.base->info().renders_force);
  // The ground truth of the base says nothing about a part that is not in the base.
  info.has_truth = false;
  info.has_external_position = parts.instrument != nullptr;
  if (parts.device) {
    info.device = parts.device->info();
    info.uncertain = parts.device->uncertain();
  }
  if (parts.sensor) info.sensor = parts.sensor->info();
  std::string name;
  const auto add = [&name](const std::string& part) { name += (name.empty() ? "" : " + ") + part; };
  if (parts.device) add(parts.device->report().driver);
  if (parts.sensor) add(parts.sensor->report().driver);
  if (parts.base) add(parts.base->info().name);
  info.name = name;
  return info;
}

}  // namespace

// The clock's thread sets in_use_ and then reads open_; close() clears open_ and then reads in_use_. So at
// least one of the two sees the other (all sequentially consistent).
void ComposedRig::Access::close() noexcept {
  open_.store(false);
  while (in_use_.load()) std::this_thread::sleep_for(std::chrono::microseconds(50));
}

ComposedRig::ComposedRig(RigParts parts, double rate_hz)
    : parts_(std::move(parts)), info_(describe(parts_, rate_hz)) {}

ComposedRig::~ComposedRig() {
  disengage_instrument();
  disengage(RigPartKind::kForceSensor);
  disengage(RigPartKind::kDevice);
}

std::optional<Error> ComposedRig::engage_instrument() {
  if (!parts_.instrument) return std::nullopt;
  if (auto error = parts_.instrument->engage()) return error;
  instrument_access_.open();
  return std::nullopt;
}

void ComposedRig::disengage_instrument() noexcept {
  if (!parts_.instrument) return;
  instrument_access_.close();
  parts_.instrument->disengage();
}

std::optional<Error> ComposedRig::engage(RigPartKind part) {
  const bool is_device = part == RigPartKind::kDevice;
  RigPart* hardware = is_device ? static_cast<RigPart*>(parts_.device.get()) : parts_.sensor.get();
  if (hardware == nullptr) return std::nullopt;
  if (auto error = hardware->engage()) return error;
  if (is_device && !device_reported_)
    info_.device = parts_.device->info();  // it may have reported its own limits
  device_reported_ = device_reported_ || is_device;
  (is_device ? device_access_ : sensor_access_).open();
  return std::nullopt;
}

void ComposedRig::disengage(RigPartKind part) noexcept {
  const bool is_device = part == RigPartKind::kDevice;
  RigPart* hardware = is_device ? static_cast<RigPart*>(parts_.device.get()) : parts_.sensor.get();
  if (hardware == nullptr) return;
  (is_device ? device_access_ : sensor_access_).close();
  hardware->disengage();
}

std::vector<PartReport> ComposedRig::reports() const {
  std::vector<PartReport> all;
  if (parts_.device) all.push_back(parts_.device->report());
  if (parts_.sensor) all.push_back(parts_.sensor->report());
  if (parts_.instrument) all.push_back(parts_.instrument->report());
  return all;
}

std::optional<Error> ComposedRig::bias_force_sensor() {
  if (parts_.sensor) return parts_.sensor->bias();
  return parts_.base ? parts_.base->bias_force_sensor() : Rig::bias_force_sensor();
}

std::optional<Error> ComposedRig::home_device() {
  return parts_.device ? parts_.device->home() : Rig::home_device();
}

void ComposedRig::read(RigSample& sample) noexcept {
  if (parts_.base) {
    parts_.base->read(sample);
  } else {
    sample = RigSample{};
    sample.status |= sample_status::kForceMissing;
  }
  sample.tick = ticks_++;
  if (parts_.device) {
    sample.status &= kOfForce;
    sample.tip_position_mm = last_.tip_position_mm;
    sample.tip_orientation = last_.tip_orientation;
    sample.angles = last_.angles;
    sample.position_age_ns = 0;
    sample.max_force_n = 0.0;
    if (!device_access_.with([&] { parts_.device->read(sample); })) {
      sample.status |= sample_status::kDeviceNotReady;
    }
    last_ = sample;
  }
  // Time at which the device was read; ages count from here. A base has its own clock.
  if (!parts_.base) {
    const Clock::time_point now = Clock::now();
    if (sample.tick == 0) started_ = now;
    sample.time_ns = nanoseconds(now - started_);
  }
  if (parts_.sensor) {
    sample.status &= ~kOfForce;
    if (!sensor_access_.with([&] { parts_.sensor->read(sample); })) {
      sample.sensor_force_n = {};
      sample.sensor_torque_n_mm = {};
      sample.force_count = 0;
      sample.force_age_ns = std::numeric_limits<std::int64_t>::max();
      sample.force_mean_age_ns = std::numeric_limits<std::int64_t>::max();
      sample.bias_serial = bias_serial_;
      sample.status |= sample_status::kForceMissing;
    }
    bias_serial_ = sample.bias_serial;
  }
  // After the sensor: on one board it is the sensor that reads the scans.
  if (parts_.instrument) {
    outside_mm_ = sample.tip_position_mm;
    has_outside_ = false;
    instrument_access_.with([&] { has_outside_ = parts_.instrument->read(outside_mm_); });
  }
}

bool ComposedRig::external_position(Vector3& position_mm) const noexcept {
  if (has_outside_) position_mm = outside_mm_;
  return has_outside_;
}

void ComposedRig::write(const DeviceCommand& command) noexcept {
  if (!parts_.device) {
    if (parts_.base) parts_.base->write(command);
    return;
  }
  device_access_.with([&] { parts_.device->write(command); });
}

void ComposedRig::write_zero_in_crash() noexcept {
  if (parts_.device) parts_.device->write_zero_in_crash();
}

}  // namespace hapticd::hal
