#include <cmath>
#include <cstdint>
#include <limits>
#include <vector>

#include "hal/sim/base/random.h"
#include "rt/contact/free_motion_residual.h"
#include "rt/loop/latency_histogram.h"
#include "rt/signal/motion_estimator.h"
#include "rt/signal/vector.h"
#include "server/identification/estimate/tool_excitation.h"
#include "server/identification/session/contact/contact_identification.h"
#include "tests/measure/study/common/hands.h"
#include "tests/measure/study/common/scenes.h"
#include "tests/measure/study/common/virtual_run.h"
#include "tests/measure/study/extremes/extreme.h"
#include "tests/measure/study/extremes/fed_scene.h"

namespace hapticd::study::extremes {

namespace {

constexpr double kRateHz = 1000.0;
constexpr std::int64_t kHundredDaysNs = 100LL * 86'400 * 1'000'000'000;

/// Presses of a hand on the foam ball, unrendered, as rig and sensor show them.
const std::vector<hal::RigSample>& presses() {
  static const std::vector<hal::RigSample> samples = [] {
    VirtualRun run(explore_rig("phantom_1_5_high_force", "foam_ball_3d", "rod"), tap_scene(), false);
    sim::HandProgram hand = pressing(3.0);
    hand.repetitions = -1;
    hand.hold_s = 0.3;
    hand.force_rate_n_per_s = 6.0;
    run.set_hand(hand);
    std::vector<hal::RigSample> all;
    for (int i = 0; i < 12'000; ++i) {
      run.step();
      all.push_back(run.sample());
    }
    return all;
  }();
  return samples;
}

/// Two of a kind on the same samples, one of them a hundred days later: the largest difference.
template <class Make, class Step>
double hundred_days_later(const Make& make, const Step& step) {
  auto today = make();
  auto later = make();
  Largest largest;
  for (const hal::RigSample& sample : presses()) {
    hal::RigSample shifted = sample;
    shifted.time_ns += kHundredDaysNs;
    shifted.tick += static_cast<std::uint64_t>(kHundredDaysNs / 1'000'000);
    largest.see(step(later, shifted) - step(today, sample));
  }
  return largest.value();
}

double motion_later(const Effort&) {
  return hundred_days_later([] { return rt::MotionEstimator(0.007, kRateHz); },
                            [](rt::MotionEstimator& m, const hal::RigSample& s) {
                              m.update(s.tip_position_mm.z, s.time_ns);
                              return m.velocity_mm_per_s() + 1e-3 * m.acceleration_mm_per_s2();
                            });
}

double residual_later(const Effort&) {
  return hundred_days_later([] { return rt::FreeMotionResidual(9.35, kRateHz); },
                            [](rt::FreeMotionResidual& r, const hal::RigSample& s) {
                              return r.update(s.sensor_force_n.z, s.tip_position_mm.z, s.time_ns, false);
                            });
}

double tool_later(const Effort&) {
  return hundred_days_later([] { return identification::ToolExcitationFilter(kRateHz, true); },
                            [](identification::ToolExcitationFilter& f, const hal::RigSample& s) {
                              const auto e = f.update(s);
                              return e ? rt::norm(e->force_n) + rt::norm(e->weight_n_per_g) : 0.0;
                            });
}

double scene_later(const Effort&) {
  return hundred_days_later([] { return FedScene(tap_scene(), nullptr); },
                            [](FedScene& scene, const hal::RigSample& s) {
                              const rt::TickRecord record = scene.tick(s);
                              return rt::norm(record.device_command_n) + record.displacement_mm;
                            });
}

/// Identification counts time in seconds as doubles: a hundred days later a tick is known to 1.9 ns.
double identified_later(const Effort&) {
  const auto stiffness = [](std::int64_t later_ns) {
    identification::ContactIdentification identification(identification::ContactTask{},
                                                         FedScene(tap_scene(), nullptr).info());
    rt::Observation observation;
    for (const hal::RigSample& sample : presses()) {
      observation.sample = sample;
      observation.sample.time_ns += later_ns;
      identification.add(observation);
    }
    const auto model = identification.finish();
    if (!model) return std::nan("");
    return std::get<rt::ContactModel>(model->content).hunt_crossley->parameters.stiffness_n_per_mm_m;
  };
  return std::abs(stiffness(kHundredDaysNs) / stiffness(0) - 1.0);
}

double tick_resolution(const Effort& effort) {
  Largest largest;
  const long ticks = effort.ticks(0.3);
  std::int64_t time_ns = kHundredDaysNs;
  double before = 1e-9 * static_cast<double>(time_ns);
  for (long i = 0; i < ticks; ++i) {
    time_ns += 1'000'000;
    const double now = 1e-9 * static_cast<double>(time_ns);
    largest.see((now - before) / 1e-3 - 1.0);
    before = now;
  }
  return largest.value();
}

double days_to_2_53() {
  return std::ldexp(1.0, 53) / 86'400e9;
}

double nanoseconds_in_double(const Effort&) {
  // Every nanosecond is still a separate double: the last of the 100 days.
  Largest largest;
  for (std::int64_t i = 0; i < 1'000'000; ++i) {
    const std::int64_t time_ns = kHundredDaysNs - i;
    largest.see(static_cast<double>(static_cast<std::int64_t>(static_cast<double>(time_ns)) - time_ns));
  }
  return days_to_2_53() > 100.0 ? largest.value() : 1.0;
}

double histogram_quantile(const Effort&) {
  Largest largest;
  for (double size = 16.0; size < 1e12; size *= 1.01) {
    rt::LatencyHistogram histogram;
    histogram.record(static_cast<std::int64_t>(size));
    histogram.record(static_cast<std::int64_t>(2.0 * size));
    const double reported = static_cast<double>(histogram.snapshot().quantile_ns(0.5));
    largest.see(reported / std::floor(size) - 1.0);
  }
  return largest.value();
}

double histogram_extremes(const Effort&) {
  rt::LatencyHistogram histogram;
  for (const std::int64_t ns :
       {std::numeric_limits<std::int64_t>::min(), std::int64_t{-1}, std::int64_t{0}}) {
    histogram.record(ns);
  }
  return static_cast<double>(histogram.snapshot().quantile_ns(1.0));
}

}  // namespace

ExtremeGroup time_extremes() {
  return {"time",
          "Time stamps after 100 days at 1 kHz",
          {
              {"motion estimator", "the same samples 100 days later", "difference", "mm/s", 0.0,
               "int64 ns, differences only", motion_later},
              {"free-motion residual", "the same samples 100 days later", "difference", "N", 0.0,
               "int64 ns, differences only", residual_later},
              {"tool excitation", "the same samples 100 days later", "difference", "N", 0.0,
               "int64 ns, differences only", tool_later},
              {"scene tap_1d", "the same samples 100 days later", "difference of command and displacement",
               "N, mm", 0.0, "int64 ns, differences only", scene_later},
              {"contact identification", "the same samples 100 days later", "change of K", "1", 1e-5,
               "1.9 ns of a tick, five times", identified_later},
              {"seconds as double", "differences after 100 days", "error of a tick", "1",
               std::ldexp(1.0, -29) / 1e-3 * 1.01, "2^-29 s between doubles at 8.6e6 s", tick_resolution},
              {"nanoseconds as double", "up to 100 days", "nanoseconds off", "ns", 0.0,
               "2^53 ns are 104 days", nanoseconds_in_double},
              {"latency histogram", "16 ns … 1000 s", "error of a quantile", "1", 1.0 / 16.0,
               "16 buckets an octave", histogram_quantile},
              {"latency histogram", "negative and zero latencies", "largest reported", "ns", 0.0,
               "count as zero", histogram_extremes},
          }};
}

}  // namespace hapticd::study::extremes
