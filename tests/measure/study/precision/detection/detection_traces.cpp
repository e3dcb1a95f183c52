#include "tests/measure/study/precision/detection/detection_traces.h"

#include <algorithm>
#include <memory>

#include "hal/sim/simulated_rig.h"
#include "tests/measure/study/common/hands.h"
#include "tests/measure/study/common/plant.h"
#include "tests/support/value_of.h"

namespace hapticd::study {

namespace {

using test::demand;
using test::value_of;

/// Rig without commands.
class WatchedRig {
 public:
  WatchedRig(const std::string& object, const sim::HandProgram& hand, std::uint64_t seed) {
    sim::SimulationConfig config;
    config.object = object;
    config.seed = seed;
    config.tool_mass_g = kDetectionToolG;
    rig_ = value_of(create_rig(config));
    demand(rig_->set_program(hand));
  }
  DetectionTick step() {
    hal::RigSample sample;
    rig_->read(sample);
    rig_->write({});
    rig_->truth(truth_);
    return {sample.sensor_force_n.z, -sample.tip_position_mm.z, sample.time_ns, truth_.in_contact};
  }
  const hal::TruthSample& truth() const { return truth_; }

 private:
  std::unique_ptr<sim::SimulatedRig> rig_;
  hal::TruthSample truth_;
};

constexpr double kTickMs = 1.0;

}  // namespace

std::vector<DetectionTick> shaken_trace(double seconds, std::uint64_t seed) {
  WatchedRig rig("none", shaken(), seed);
  std::vector<DetectionTick> ticks;
  while (static_cast<double>(ticks.size()) < 1e3 / kTickMs * seconds) ticks.push_back(rig.step());
  return ticks;
}

TappedTrace tapped_trace(const std::string& object, double speed_mm_per_s, int taps, std::uint64_t seed) {
  const sim::HandProgram hand = tapping(speed_mm_per_s, taps);
  WatchedRig rig(object, hand, seed);
  TappedTrace trace{object, speed_mm_per_s, {}, {}};
  constexpr std::size_t kFlightTicks = 100;
  const auto end = static_cast<std::size_t>(1e3 * (2.0 + taps / hand.rate_hz));
  double height_before_mm = 0.0;
  std::size_t last_touched = 0;
  for (std::size_t k = 0; k < end; ++k) {
    const DetectionTick tick = rig.step();
    trace.ticks.push_back(tick);
    const double height_mm = rig.truth().tip_position_mm.z;
    const double fall_mm = height_before_mm - height_mm;
    height_before_mm = height_mm;
    if (!tick.touches) continue;
    if (k - last_touched > kFlightTicks) {
      constexpr double kMinFallMm = 1e-3;  // a speed of 1 mm/s
      const double since_ms = kTickMs * rig.truth().displacement_mm / std::max(kMinFallMm, fall_mm);
      trace.strikes.push_back({k, k, 1e-6 * static_cast<double>(tick.time_ns) - since_ms});
    }
    if (!trace.strikes.empty()) trace.strikes.back().last_tick = k;
    last_touched = k;
  }
  return trace;
}

}  // namespace hapticd::study
