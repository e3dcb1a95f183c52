#include "server/identification/gate/sample_gate.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "rt/signal/vector.h"

namespace hapticd::identification {

namespace {

constexpr std::array<const char*, kUnfitKinds> kReasons{
    "the sensor is at its end of range",   "no fresh force",       "a fault of sensor or device",
    "not a number, or beyond what can be", "the force is too old", "time does not increase"};

}  // namespace

bool SampleGate::is_a_number(const rt::Observation& observation) const noexcept {
  const hal::RigSample& sample = observation.sample;
  if (policy_.press_axis_only) {
    return std::isfinite(sample.sensor_force_n.z) && std::isfinite(sample.tip_position_mm.z);
  }
  if (!finite(sample.tip_position_mm) || rt::norm(sample.tip_position_mm) > policy_.max_position_mm)
    return false;
  if (policy_.force &&
      (!finite(sample.sensor_force_n) || rt::norm(sample.sensor_force_n) > policy_.max_force_n)) {
    return false;
  }
  if (policy_.torque && !finite(sample.sensor_torque_n_mm)) return false;
  if (policy_.command && !finite(observation.device_command_n)) return false;
  const hal::Quaternion& q = sample.tip_orientation;
  return !policy_.orientation ||
         (std::isfinite(q.w + q.x + q.y + q.z) &&
          q.w * q.w + q.x * q.x + q.y * q.y + q.z * q.z >= policy_.min_orientation_norm_squared);
}

bool SampleGate::is(Unfit reason, const rt::Observation& observation) noexcept {
  namespace status = hal::sample_status;
  const hal::RigSample& sample = observation.sample;
  const std::uint32_t reported = sample.status & policy_.status;
  const hal::Vector3& force_n = sample.sensor_force_n;
  switch (reason) {
    case Unfit::kSaturated:
      if ((reported & status::kForceSaturated) != 0) return true;
      if ((policy_.press_axis_only ? std::abs(force_n.z) : rt::norm(force_n)) >= policy_.end_of_range_n)
        return true;
      return policy_.clip.refuses && clip_.clipped(force_n.z, -sample.tip_position_mm.z);
    case Unfit::kNoForce:
      return (reported & status::kForceMissing) != 0;
    case Unfit::kFault:
      return (reported & ~(status::kForceSaturated | status::kForceMissing)) != 0;
    case Unfit::kNotANumber:
      return !is_a_number(observation);
    case Unfit::kStale:
      return sample.force_age_ns > policy_.max_force_age_ns;
    case Unfit::kDisordered:
      break;
  }
  return false;
}

SampleGate::Verdict SampleGate::leave_out(Unfit reason) noexcept {
  ++left_out_[static_cast<std::size_t>(reason)];
  if ((policy_.interrupting >> static_cast<unsigned>(reason) & 1U) == 0) return Verdict::kSkip;
  forget();
  return Verdict::kInterrupt;
}

std::optional<SampleGate::Verdict> SampleGate::refuse(const rt::Observation& observation) noexcept {
  last_s_ = 1e-9 * static_cast<double>(observation.sample.time_ns);
  if (judged_++ == 0) first_s_ = last_s_;
  for (const Unfit reason : policy_.order) {
    if (is(reason, observation)) return leave_out(reason);
  }
  return std::nullopt;
}

SampleGate::Verdict SampleGate::follow(const rt::Observation& observation) noexcept {
  const hal::RigSample& sample = observation.sample;
  const double step_s = 1e-9 * static_cast<double>(sample.time_ns - last_time_ns_);
  if (follows_ && !(step_s > 0.0)) return leave_out(Unfit::kDisordered);
  const bool gap = follows_ && step_s > policy_.max_step_s;
  if (gap) {
    ++gaps_;
    longest_gap_s_ = std::max(longest_gap_s_, step_s);
  }
  if (!policy_.clip.refuses && clip_.clipped(sample.sensor_force_n.x, sample.tip_position_mm.x)) ++repeated_;
  step_s_ = follows_ ? step_s : 0.0;
  follows_ = true;
  last_time_ns_ = sample.time_ns;
  ++used_;
  return gap ? Verdict::kRestart : Verdict::kUse;
}

SampleGate::Verdict SampleGate::judge(const rt::Observation& observation) noexcept {
  const std::optional<Verdict> refused = refuse(observation);
  return refused ? *refused : follow(observation);
}

namespace {
std::string counted(std::uint64_t count, const char* noun) {
  return std::to_string(count) + " " + noun + (count == 1 ? "" : "s");
}
}  // namespace

std::vector<std::string> SampleGate::remarks() const {
  std::vector<std::string> remarks;
  for (std::size_t i = 0; i < kUnfitKinds; ++i) {
    if (left_out_[i] > 0) {
      remarks.push_back(counted(left_out_[i], "sample") + " left out as unfit: " + kReasons[i]);
    }
  }
  if (repeated_ > 0) {
    remarks.push_back(counted(repeated_, "sample") +
                      " with exactly the largest force: if that is the end of the sensor's "
                      "range, the friction found is too small");
  }
  if (gaps_ > 0) {
    char text[80];
    std::snprintf(text, sizeof text, " in the data, the longest of %.3g s", longest_gap_s_);
    remarks.push_back(counted(gaps_, "gap") + text);
  }
  return remarks;
}

}  // namespace hapticd::identification
