#include "server/identification/gate/stroke_gate.h"

#include <algorithm>
#include <cmath>

#include "rt/signal/vector.h"
#include "server/identification/gate/sample_step.h"

namespace hapticd::rt {

namespace {

std::string counted(std::uint64_t count, const char* what) {
  return std::to_string(count) + " " + what;
}

}  // namespace

StrokeGate::StrokeGate(const hal::RigInfo& rig) noexcept
    : period_s_(rig.rate_hz > 0.0 ? 1.0 / rig.rate_hz : 1e-3), range_n_(rig.sensor.range_n) {}

StrokeGate::Verdict StrokeGate::judge(const hal::RigSample& sample) noexcept {
  ++judged_;
  const hal::Quaternion& q = sample.tip_orientation;
  if (!finite(sample.tip_position_mm) || !finite(sample.sensor_force_n) ||
      !std::isfinite(q.w + q.x + q.y + q.z)) {
    ++non_finite_;
    return Verdict::kSkip;
  }
  if (started_ && sample.time_ns <= last_time_ns_) {
    ++disordered_;
    return Verdict::kSkip;
  }
  if ((sample.status & hal::sample_status::kForceSaturated) != 0U ||
      (range_n_ > 0.0 && norm(sample.sensor_force_n) > 0.995 * range_n_)) {
    ++saturated_;
    return Verdict::kSkip;
  }
  if (sample.status != 0U) {
    ++unfit_;
    return Verdict::kSkip;
  }
  const double since_s = 1e-9 * static_cast<double>(sample.time_ns - last_time_ns_);
  const bool gap = started_ && since_s > std::max(kGapPeriods * period_s_, kMaxSampleStepS);
  if (gap) {
    ++gaps_;
    longest_gap_s_ = std::max(longest_gap_s_, since_s);
  }
  watch_for_clipping(sample.sensor_force_n.x, sample.tip_position_mm.x);
  started_ = true;
  last_time_ns_ = sample.time_ns;
  ++used_;
  return gap ? Verdict::kRestart : Verdict::kUse;
}

void StrokeGate::watch_for_clipping(double along_n, double along_mm) noexcept {
  if (along_n == last_n_) {
    ++run_;
  } else {
    run_ = 0;
    run_from_mm_ = along_mm;
  }
  last_n_ = along_n;
  largest_n_ = std::max(largest_n_, std::abs(along_n));
  constexpr double kMovesMm = 0.01;
  if (run_ >= kClipRun && std::abs(along_n) >= largest_n_ && along_n != 0.0 &&
      std::abs(along_mm - run_from_mm_) > kMovesMm) {
    ++repeated_;
  }
}

std::vector<std::string> StrokeGate::remarks() const {
  std::vector<std::string> remarks;
  if (non_finite_ > 0) remarks.push_back(counted(non_finite_, "samples that are no numbers left out"));
  if (saturated_ > 0)
    remarks.push_back(counted(saturated_, "samples at the end of the sensor's range left out"));
  if (repeated_ > 0) {
    remarks.push_back(counted(repeated_,
                              "samples repeat the largest force to the last bit: if that is the end of "
                              "the sensor's range, the friction found is too small"));
  }
  if (unfit_ > 0) remarks.push_back(counted(unfit_, "samples without a fit force reading left out"));
  if (disordered_ > 0)
    remarks.push_back(counted(disordered_, "samples whose time did not increase left out"));
  if (gaps_ > 0) {
    remarks.push_back(counted(gaps_, "gaps, the longest of ") + std::to_string(longest_gap_s_) +
                      " s: friction's state was taken up again after each");
  }
  return remarks;
}

}  // namespace hapticd::rt
