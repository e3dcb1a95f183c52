#include "server/identification/gate/palpation_gate.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

namespace hapticd::rt {

PalpationGate::PalpationGate(const hal::RigInfo& rig) noexcept
    : period_s_(rig.rate_hz > 0.0 ? 1.0 / rig.rate_hz : 1e-3), range_n_(rig.sensor.range_n) {}

bool PalpationGate::clipped(double force_n, double depth_mm) noexcept {
  const double magnitude = std::abs(force_n);
  shallowest_mm_ = std::min(shallowest_mm_, depth_mm);
  deepest_mm_ = std::max(deepest_mm_, depth_mm);
  largest_n_ = std::max(largest_n_, magnitude);
  if (force_n == last_force_n_ && magnitude > 0.0 && magnitude >= largest_n_) {
    ++run_;
  } else {
    run_ = 0;
    run_depth_mm_ = depth_mm;
  }
  last_force_n_ = force_n;
  const bool moves = std::abs(depth_mm - run_depth_mm_) > 0.005 * (deepest_mm_ - shallowest_mm_);
  return run_ >= kClipRun && moves;
}

PalpationGate::Verdict PalpationGate::judge(const hal::RigSample& sample) noexcept {
  ++judged_;
  const double force_n = sample.sensor_force_n.z;
  const double depth_mm = -sample.tip_position_mm.z;
  if (!std::isfinite(force_n) || !std::isfinite(depth_mm)) {
    ++non_finite_;
    return Verdict::kSkip;
  }
  namespace status = hal::sample_status;
  if ((sample.status & (status::kForceMissing | status::kForceFault | status::kDeviceFault)) != 0) {
    ++missing_;
    return Verdict::kSkip;
  }
  const bool at_end = range_n_ > 0.0 && std::abs(force_n) >= 0.999 * range_n_;
  if ((sample.status & status::kForceSaturated) != 0 || at_end || clipped(force_n, depth_mm)) {
    ++saturated_;
    return Verdict::kSkip;
  }
  const double step_s = 1e-9 * static_cast<double>(sample.time_ns - last_time_ns_);
  if (started_ && !(step_s > 0.0)) {
    ++disordered_;
    return Verdict::kSkip;
  }
  const bool gap = started_ && step_s > kGapPeriods * period_s_;
  last_time_ns_ = sample.time_ns;
  ++used_;
  if (gap) {
    ++gaps_;
    longest_gap_s_ = std::max(longest_gap_s_, step_s);
  }
  const bool first = !started_;
  started_ = true;
  return gap || first ? Verdict::kRestart : Verdict::kUse;
}

std::vector<std::string> PalpationGate::remarks() const {
  std::vector<std::string> remarks;
  const auto left_out = [&](std::uint64_t count, const char* why) {
    if (count > 0) remarks.push_back(std::to_string(count) + " samples left out: " + why);
  };
  left_out(non_finite_, "not a number");
  left_out(missing_, "no fresh force, or a fault of sensor or device");
  left_out(saturated_, "the sensor is at its end of range; press less hard");
  left_out(disordered_, "time does not increase");
  if (gaps_ > 0) {
    char text[80];
    std::snprintf(text, sizeof text, "%llu gaps in the data, the longest of %.3g s",
                  static_cast<unsigned long long>(gaps_), longest_gap_s_);
    remarks.emplace_back(text);
  }
  return remarks;
}

}  // namespace hapticd::rt
