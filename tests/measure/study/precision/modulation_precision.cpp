#include <cmath>
#include <string>
#include <vector>

#include "rt/inclusion/rendered_inclusions.h"
#include "rt/signal/vector.h"
#include "tests/measure/report/run_time.h"
#include "tests/measure/report/work_precision.h"
#include "tests/measure/study/common/parts.h"
#include "tests/measure/study/common/plant.h"
#include "tests/measure/study/common/scenes.h"
#include "tests/measure/study/modulation/friction_trial.h"
#include "tests/measure/study/modulation/transient_trial.h"
#include "tests/measure/study/precision/estimation_stages.h"
#include "tests/measure/study/tumour/tumour_trial.h"

namespace hapticd::study {

namespace {

using report::fixed;

/// A slow loop around the inclusion, pressed 2 to 10 mm deep.
std::vector<rt::Indentation> palpation_path() {
  std::vector<rt::Indentation> path;
  for (int i = 0; i < 2000; ++i) {
    const double phase = 2.0 * M_PI * i / 2000.0;
    const double depth_mm = 6.0 - 4.0 * std::cos(3.0 * phase);
    path.push_back(
        {{15.0 * std::sin(phase), 10.0 * std::cos(phase), -depth_mm}, {0.0, 0.0, 1.0}, depth_mm, 10.0});
  }
  return path;
}

double inclusion_time_ns(const rt::InclusionParameters& inclusion, double seconds) {
  const std::vector<rt::Indentation> path = palpation_path();
  rt::InclusionParameters here = inclusion;
  here.place_mm = {0.0, 0.0, -rt::norm(inclusion.place_mm - inclusion.surface_mm)};
  here.surface_mm = {};
  return report::run_time_ns(
      path.size(),
      [&] {
        rt::RenderedInclusions law({here});
        double sum = 0.0;
        for (const rt::Indentation& at : path) sum += law.update(at).z;
        return sum;
      },
      seconds);
}

void add_inclusion_stage(StudyContext& context, double seconds) {
  const IdentifiedTumour& tumour = identified_tumour("phantom_hard");
  rt::InclusionParameters plain = tumour.by_scan.inclusion;
  plain.attenuation = rt::InclusionParameters{}.attenuation;
  plain.approach = rt::InclusionParameters{}.approach;
  report::WorkPrecision stage;
  stage.stage = "inclusion";
  stage.error_name = "force error over the real tumour's";
  stage.logarithmic_error = false;
  stage.remark =
      "Presses at 60 mm/s, 0, 10 and 20 mm from a hard tumour in a phantom (finite elements), rendered in "
      "the "
      "phantom without one: rms difference of the force at the hand over the rms of the real one, while "
      "loading; "
      "mean of the three places. Run time of the law alone.";
  stage.justification = "the other laws are wrong by more next to the tumour, or know less of it.";
  struct Way {
    const char* name;
    rt::InclusionParameters inclusion;
    bool is_default;
  };
  for (const Way& way : {Way{"energy, n and β by a scan", tumour.by_scan.inclusion, true},
                         Way{"energy, n = 6 and β = 1/2", plain, false},
                         Way{"published, (5.4) to (5.7)", tumour.by_pair.inclusion, false}}) {
    double error = 0.0;
    for (const double place_mm : {0.0, 10.0, 20.0}) {
      const PhantomPress press{place_mm, 0.0, 11.5, 60.0};
      error += curve_error(press_rendered({way.inclusion}, press), press_real("phantom_hard", press)) / 3.0;
    }
    stage.methods.push_back({way.name, error, inclusion_time_ns(way.inclusion, seconds), way.is_default, {}});
  }
  add_stage(context.report, stage);
}

/// Processor time of one second of a trial, simulated rig included; in ns.
template <class Run>
double second_of(double simulated_s, const Run& run) {
  const double start_ns = report::thread_time_ns();
  run();
  return (report::thread_time_ns() - start_ns) / simulated_s;
}

void add_friction_stage(StudyContext& context) {
  report::WorkPrecision stage;
  stage.stage = "friction_target";
  stage.error_name = "friction error at the hand";
  stage.run_time_per = "rendered second";
  stage.logarithmic_error = false;
  stage.remark =
      "Strokes of 30 mm at 60 mm/s and 1 N on the objects of D§4, friction scaled to 0.5 and 1.5: "
      "|tangential force "
      "at the hand over the target's - 1| in steady sliding, mean. Run time of a whole second: loop and "
      "simulated "
      "rig.";
  stage.justification = "it is the rate that every device gives; a faster loop is no more exact.";
  run_trial({.object = explored_objects().front(), .seconds = 1.0});  // what is read once is read
  for (const double rate_hz : {1000.0, 2000.0, 5000.0}) {
    double error = 0.0, time_ns = 0.0;
    int trials = 0;
    std::string failed;
    for (const std::string& object : explored_objects()) {
      for (const double scale : {0.5, 1.5}) {
        if (context.quick && trials == 2) continue;
        FrictionTrial trial;
        trial.object = object;
        trial.force_n = 1.0;
        trial.rate_hz = rate_hz;
        trial.target.emplace().scale = scale;
        FrictionOutcome out;
        time_ns += second_of(trial.seconds, [&] { out = run_trial(trial); });
        if (!out.failed.empty()) failed = object + ": " + out.failed;
        error += std::abs(out.scale / scale - 1.0);
        ++trials;
      }
    }
    stage.methods.push_back(
        {fixed(rate_hz / 1000.0, 0) + " kHz", error / trials, time_ns / trials, rate_hz == 1000.0, failed});
  }
  add_stage(context.report, stage);
}

void add_transient_stage(StudyContext& context) {
  report::WorkPrecision stage;
  stage.stage = "transient";
  stage.error_name = "decay error at the grip";
  stage.run_time_per = "rendered second";
  stage.logarithmic_error = false;
  stage.remark =
      "Taps of 200 mm/s on the sponge, one mode of 30, 60 and 100 Hz and 80 1/s: |decay at the grip over the "
      "target's "
      "- 1|, mean; what the transient adds to the acceleration of the tip. Run time of a whole second: loop "
      "and "
      "simulated rig.";
  stage.justification = "1 kHz is what every device gives; a scene for 5 kHz is exact to some percent.";
  for (const double rate_hz : {1000.0, 2000.0, 5000.0}) {
    TransientTrial trial;
    trial.rate_hz = rate_hz;
    const TapLog without = tap(trial);
    double error = 0.0, time_ns = 0.0;
    std::string failed = without.failed;
    for (const double hz : {30.0, 60.0, 100.0}) {
      const rt::TransientMode mode{hz, 80.0, 15.0};
      trial.transient.emplace().target = {mode};
      TapLog with;
      time_ns += second_of(1.0, [&] { with = tap(trial); });
      if (!with.failed.empty()) failed = with.failed;
      error += std::abs(fit_added(with, without, mode).decay_per_s / mode.decay_per_s - 1.0) / 3.0;
    }
    stage.methods.push_back(
        {fixed(rate_hz / 1000.0, 0) + " kHz", error, time_ns / 3.0, rate_hz == 1000.0, failed});
  }
  add_stage(context.report, stage);
}

}  // namespace

void run_modulation_precision(StudyContext& context) {
  add_inclusion_stage(context, context.quick ? 0.01 : 0.2);
  add_friction_stage(context);
  add_transient_stage(context);
}

}  // namespace hapticd::study
