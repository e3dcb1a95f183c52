#include "server/identification/session/inclusion/press_collector.h"

#include <algorithm>
#include <utility>

#include "rt/signal/ticks.h"
#include "rt/signal/vector.h"
#include "server/identification/gate/sample_policy.h"

namespace hapticd::identification {

namespace {

constexpr double kKeptHz = 50.0;
constexpr double kFreeAgainS = 0.03;  // below the threshold: noise alone does not end a press

double usable_rate_hz(const hal::RigInfo& rig) {
  return std::clamp(rig.rate_hz, 10.0, 1e5);
}

}  // namespace

PressCollector::PressCollector(const hal::RigInfo& rig, double threshold_n)
    : gate_(scan_policy(rig)),
      motion_(rig.device.position_resolution_mm, usable_rate_hz(rig)),
      load_(rig.sensor.tool_mass_g, {0.0, 0.0, -1.0}),
      threshold_n_(threshold_n),
      settling_ticks_(rt::ticks_of(kPalpationSettlingS, usable_rate_hz(rig))) {}

void PressCollector::add(const rt::Observation& observation) {
  const SampleGate::Verdict verdict = gate_.judge(observation);
  if (verdict == SampleGate::Verdict::kSkip) return;
  if (verdict != SampleGate::Verdict::kUse) {
    motion_.reset();
    ticks_since_restart_ = 0;
    if (touching_) ++interrupted_;
    touching_ = was_free_ = false;
    quiet_mm_.reset();
    if (verdict == SampleGate::Verdict::kInterrupt) return;
  }
  const hal::RigSample& sample = observation.sample;
  motion_.update(sample.tip_position_mm, sample.time_ns);
  if (ticks_since_restart_++ < settling_ticks_) return;

  PressSample s;
  s.tip_mm = sample.tip_position_mm;
  s.velocity_mm_per_s = motion_.velocity_mm_per_s();
  s.force_n = load_.without_weight_n(sample) + load_.inertia_n(motion_.acceleration_mm_per_s2());
  const double force_n = rt::norm(s.force_n);
  const double step_s = gate_.step_s();
  if (!touching_) {
    if (force_n < Press::kQuietShare * threshold_n_) quiet_mm_ = s.tip_mm;
    if (force_n < 0.5 * threshold_n_) was_free_ = seen_free_ = true;
    if (!was_free_ || force_n <= threshold_n_) return;
    touching_ = true;
    press_ = {surface_before(quiet_mm_, s.tip_mm), {}};
    since_s_ = below_s_ = deepest_mm_ = largest_n_ = 0.0;
    step_s_ = 1.0 / kKeptHz;
    kept_s_ = -step_s_;
  } else {
    since_s_ += step_s;
  }
  deepest_mm_ = std::max(deepest_mm_, rt::norm(s.tip_mm - press_.surface_mm));
  largest_n_ = std::max(largest_n_, force_n);
  below_s_ = force_n < 0.5 * threshold_n_ ? below_s_ + step_s : 0.0;
  if (below_s_ > kFreeAgainS) return finish_press();
  if (since_s_ - kept_s_ < step_s_ * (1.0 - 1e-6)) return;
  kept_s_ = since_s_;
  ++samples_;
  press_.samples.push_back(s);
  if (press_.samples.size() < kMaxSamples) return;
  std::vector<PressSample>& all = press_.samples;
  for (std::size_t i = 0; 2 * i < all.size(); ++i) all[i] = all[2 * i];
  all.resize((all.size() + 1) / 2);
  step_s_ *= 2.0;
}

void PressCollector::end() {
  if (touching_) finish_press();
}

void PressCollector::finish_press() {
  touching_ = false;
  if (deepest_mm_ < kMinDepthMm || largest_n_ < kMinForceN || press_.samples.size() < 3) {
    ++touches_;
    return;
  }
  if (presses_.size() == kMaxPresses) presses_.erase(presses_.begin());
  presses_.push_back(std::move(press_));
  press_ = {};
  ++completed_;
}

std::vector<std::string> PressCollector::remarks() const {
  std::vector<std::string> words = gate_.remarks();
  if (touches_ > 0) {
    words.push_back(std::to_string(touches_) + " touches were too light to be presses (2 mm and 0.1 N)");
  }
  if (interrupted_ > 0)
    words.push_back(interrupted_ == 1 ? "1 press was cut off by a gap"
                                      : std::to_string(interrupted_) + " presses were cut off by gaps");
  if (completed_ > presses_.size()) {
    words.push_back("the oldest " + std::to_string(completed_ - presses_.size()) +
                    " presses were dropped to bound memory");
  }
  return words;
}

}  // namespace hapticd::identification
