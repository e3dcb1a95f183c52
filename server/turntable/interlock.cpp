#include "server/turntable/interlock.h"

#include <fmt/format.h>

#include <cmath>

namespace hapticd::server {

namespace {

constexpr const char* kWhere = "interlock of the turntable";
constexpr std::uint32_t kNoForce =
    hal::sample_status::kForceMissing | hal::sample_status::kForceLost | hal::sample_status::kForceFault;

double magnitude(const hal::Vector3& vector) {
  return std::sqrt(hal::dot(vector, vector));
}

hal::Error refuse(std::string what, std::string value, std::string limit, std::string remedy) {
  return {std::move(what), kWhere, std::move(value), std::move(limit), std::move(remedy)};
}

std::string newtons(double force_n) {
  return fmt::format("{:.3g} N", force_n);
}

}  // namespace

std::optional<hal::Error> Interlock::why_not(const rt::TickRecord& last, bool free, Clock::time_point now) {
  const MutexLock lock(mutex_);
  if (!seen_ || last.tick != tick_) tick_seen_ = now;
  if ((last.sample_status & kNoForce) == 0) force_seen_ = now;
  seen_ = true;
  tick_ = last.tick;

  using Seconds = std::chrono::duration<double>;
  if (now - tick_seen_ > Seconds(config_.loop_silence_s)) {
    return refuse("the loop has stopped: contact would not be noticed", fmt::format("tick {}", last.tick), "",
                  "see in 'hapticctl status' how the loop fares");
  }
  if (last.guard_state == rt::GuardState::kLatched) {
    return refuse("the guard is latched", "", "", "fix the cause, then clear it");
  }
  if (last.guard_state == rt::GuardState::kResuming) {
    return refuse("the device's force is returning after a clear", "", "", "try again in a second");
  }
  if (!free) return refuse("the tool is in contact", "", "", "lift it off the object");
  const double command_n = magnitude(last.device_command_n);
  if (!(command_n <= config_.device_force_n)) {
    return refuse("the device renders force", newtons(command_n),
                  "at most " + newtons(config_.device_force_n), "lift the tool off the object");
  }
  if (now - force_seen_ > Seconds(config_.sensor_silence_s)) {
    if (config_.turn_without_sensor) return std::nullopt;
    return refuse(
        "the force sensor says nothing: whether the tool touches an object is not known", "", "",
        "engage the sensor, or set turn_without_sensor = true in [rig.turntable.interlock] and look "
        "yourself");
  }
  if ((last.sample_status & kNoForce) != 0) return std::nullopt;  // one tick without a sample
  const double force_n = magnitude(last.sensor_force_n);
  if (!(force_n <= config_.contact_force_n) ||
      (last.sample_status & hal::sample_status::kForceSaturated) != 0) {
    return refuse("the tool is under load", newtons(force_n), "at most " + newtons(config_.contact_force_n),
                  "lift it off the object; bias the sensor if it is free");
  }
  return std::nullopt;
}

}  // namespace hapticd::server
