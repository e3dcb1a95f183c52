#include "tests/measure/study/precision/stroke_log.h"

#include <algorithm>
#include <cmath>

#include "rt/signal/motion_estimator.h"
#include "rt/signal/vector.h"
#include "tests/measure/study/common/scenes.h"
#include "tests/measure/study/common/shadow.h"

namespace hapticd::study {

namespace {

/// The last tick at seven tenths of the median depth of the strokes.
std::size_t release_of(const std::vector<StrokeTick>& ticks) {
  std::vector<double> depths_mm;
  for (const StrokeTick& t : ticks) {
    if (t.touches && t.sliding_mm_per_s > kSlidingMmPerS) depths_mm.push_back(t.displacement_mm);
  }
  if (depths_mm.empty()) return 0;
  const auto middle = depths_mm.begin() + static_cast<std::ptrdiff_t>(depths_mm.size() / 2);
  std::nth_element(depths_mm.begin(), middle, depths_mm.end());
  std::size_t last = 0;
  for (std::size_t i = 0; i < ticks.size(); ++i) {
    if (ticks[i].displacement_mm > 0.7 * *middle) last = i;
  }
  return last;
}

}  // namespace

StrokeLog log_strokes(const std::string& object, const std::string& tip, double force_n,
                      double speed_mm_per_s, std::uint64_t seed, const std::vector<Watching>& watching) {
  sim::SimulationConfig rig = explore_rig("phantom_1_5_high_force", object, tip);
  rig.seed = seed;
  VirtualRun run = unrendered(rig);
  std::vector<Shadow> shadows;
  for (const Watching& w : watching) shadows.emplace_back(run.info(), w.scene, *w.model);
  rt::ThreeAxisMotion motion(run.info().device.position_resolution_mm, run.info().rate_hz);
  const sim::HandProgram hand = judged_strokes(force_n, speed_mm_per_s);
  run.set_hand(hand);
  const double end_s = judged_strokes_end_s(hand);
  StrokeLog log;
  hal::Vector3 last_true_mm, last_encoder_mm;
  bool was_in_contact = false;
  while (run.time_s() < end_s) {
    run.step();
    const hal::TruthSample& truth = run.truth();
    const hal::RigSample& sample = run.sample();
    StrokeTick tick;
    tick.touches = truth.in_contact;
    tick.displacement_mm = truth.displacement_mm;
    tick.sliding_mm_per_s =
        1e3 * rt::norm(rt::across(truth.tip_position_mm - last_true_mm, truth.outward_normal));
    tick.true_normal = truth.outward_normal;
    last_true_mm = truth.tip_position_mm;
    motion.update(sample.tip_position_mm, sample.time_ns);
    tick.tip_mm = sample.tip_position_mm;  // nothing is rendered, nothing bends
    tick.step_mm = sample.tip_position_mm - last_encoder_mm;
    tick.velocity_mm_per_s = motion.velocity_mm_per_s();
    last_encoder_mm = sample.tip_position_mm;
    for (Shadow& shadow : shadows) {
      shadow.watch(sample);
      const rt::TickRecord& record = shadow.record();
      tick.estimate_mm.push_back(record.in_contact ? record.displacement_mm : std::nan(""));
    }
    const rt::TickRecord& record = shadows.front().record();
    tick.in_contact = record.in_contact;
    tick.begins = record.in_contact && !was_in_contact;
    was_in_contact = record.in_contact;
    tick.reaction_n = record.reaction_n;
    tick.normal = record.normal;
    tick.normal_n = record.reaction_force_n;
    tick.rate_mm_per_s = record.velocity_mm_per_s;
    log.ticks.push_back(std::move(tick));
  }
  log.release = release_of(log.ticks);
  return log;
}

}  // namespace hapticd::study
