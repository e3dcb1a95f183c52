#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "rt/signal/adaptive_window_velocity.h"
#include "rt/signal/butterworth_low_pass.h"
#include "rt/signal/motion_estimator.h"
#include "tests/measure/report/run_time.h"
#include "tests/measure/report/work_precision.h"
#include "tests/measure/study/common/parts.h"
#include "tests/measure/study/precision/motion/motion_judge.h"
#include "tests/measure/study/precision/motion/motion_traces.h"
#include "tests/measure/study/precision/motion/plain_velocity.h"
#include "tests/measure/study/precision/motion/steady_state_kalman.h"

namespace hapticd::study {

namespace {

using report::fixed;
using report::significant;

constexpr double kRateHz = MotionTrace::kRateHz;
constexpr std::int64_t kPeriodNs = 1'000'000;

struct MethodResult {
  std::string name;
  bool is_default = false;
  std::vector<MotionError> of_motion;
  double run_time_ns = 0.0;

  /// Root mean square over the motions: each counts alike. Rest, the last one, does not count as a motion.
  double error() const {
    double sum = 0.0;
    for (std::size_t i = 0; i + 1 < of_motion.size(); ++i) sum += of_motion[i].error * of_motion[i].error;
    return std::sqrt(sum / static_cast<double>(of_motion.size() - 1));
  }
  const MotionError& at_rest() const { return of_motion.back(); }
};

/// Runs methods over the same readings of one encoder; without timing them if `seconds_per_timing` is 0.
class MotionBench {
 public:
  MotionBench(const std::vector<MotionTrace>& traces, std::vector<double> MotionTrace::*truth, double step_mm,
              double seconds_per_timing)
      : traces_(traces), truth_(truth), seconds_(seconds_per_timing) {
    for (const MotionTrace& trace : traces) readings_.push_back(trace.encoder_mm(step_mm));
  }

  /// `make()` gives a fresh estimator, of which `take(estimator, position_mm)` gives the estimate of a tick.
  template <class Make, class Take>
  void add(const std::string& name, Make make, Take take, bool is_default = false) {
    MethodResult result{name, is_default, {}, 0.0};
    for (std::size_t i = 0; i < traces_.size(); ++i) {
      auto estimator = make();
      std::vector<double> estimate;
      for (const double y : readings_[i]) estimate.push_back(take(estimator, y));
      result.of_motion.push_back(judge_motion(estimate, traces_[i].*truth_));
    }
    if (!(seconds_ > 0.0)) return results_.push_back(std::move(result));
    // Some of each motion: passes so short that most of them are not interrupted.
    const std::size_t timed = std::min<std::size_t>(readings_.front().size(), 4000);
    result.run_time_ns = report::run_time_ns(
        timed * readings_.size(),
        [&] {
          double sum = 0.0;
          for (const std::vector<double>& readings : readings_) {
            auto estimator = make();
            for (std::size_t k = 0; k < timed; ++k) sum += take(estimator, readings[k]);
          }
          return sum;
        },
        seconds_);
    results_.push_back(std::move(result));
  }

  const std::vector<MethodResult>& results() const { return results_; }

 private:
  const std::vector<MotionTrace>& traces_;
  std::vector<double> MotionTrace::*truth_;
  double seconds_;
  std::vector<std::vector<double>> readings_;
  std::vector<MethodResult> results_;
};

/// Adaptive windowing, the difference of its output, a Butterworth filter of any cut-off: MotionEstimator
/// with its cut-off and fit left open.
class WindowedAcceleration {
 public:
  WindowedAcceleration(double step_mm, double cutoff_hz, rt::AdaptiveWindowVelocity::Fit fit)
      : velocity_(step_mm, kRateHz, fit), filter_(cutoff_hz, kRateHz) {}
  double update(double position_mm) noexcept {
    const double before = velocity_.velocity_mm_per_s();
    return filter_.update((velocity_.update(position_mm) - before) * kRateHz);
  }

 private:
  rt::AdaptiveWindowVelocity velocity_;
  rt::ButterworthLowPass filter_;
};

/// The second difference, through `sections` Butterworth filters in a row.
class DifferencedTwice {
 public:
  DifferencedTwice(int sections, double cutoff_hz)
      : first_(kRateHz),
        second_(kRateHz),
        filter_{{cutoff_hz, kRateHz}, {cutoff_hz, kRateHz}},
        sections_(sections) {}
  double update(double position_mm) noexcept {
    double value = second_.update(first_.update(position_mm));
    for (int i = 0; i < sections_; ++i) value = filter_[i].update(value);
    return value;
  }

 private:
  PlainDifference first_, second_;
  rt::ButterworthLowPass filter_[2];
  int sections_;
};

constexpr auto kUpdate = [](auto& estimator, double y) { return estimator.update(y); };

void add_velocities(MotionBench& bench, double step_mm) {
  using Fit = rt::AdaptiveWindowVelocity::Fit;
  bench.add(
      "adaptive window, end fit", [=] { return rt::AdaptiveWindowVelocity(step_mm, kRateHz, Fit::kEnd); },
      kUpdate, true);
  bench.add(
      "adaptive window, best fit", [=] { return rt::AdaptiveWindowVelocity(step_mm, kRateHz, Fit::kBest); },
      kUpdate);
  bench.add(
      "difference", [] { return PlainDifference(kRateHz); }, kUpdate);
  for (const double cutoff_hz : {50.0, 100.0}) {
    bench.add(
        "difference, Butterworth " + fixed(cutoff_hz, 0) + " Hz",
        [=] { return FilteredDifference(cutoff_hz, kRateHz); }, kUpdate);
  }
  const auto velocity = [](auto& filter, double y) {
    filter.update(y);
    return filter.velocity_mm_per_s();
  };
  const double noise_mm = step_mm / std::sqrt(12.0);
  for (const double m_per_s2 : {1.0, 3.0, 10.0}) {
    bench.add(
        "Kalman α-β, " + fixed(m_per_s2, 0) + " m/s²",
        [=] { return SteadyStateKalman<2>(noise_mm, 1e3 * m_per_s2, kRateHz); }, velocity);
  }
  for (const double m_per_s2 : {0.1, 0.3, 1.0}) {
    bench.add(
        "Kalman α-β-γ, " + significant(m_per_s2, 1) + " m/s² a tick",
        [=] { return SteadyStateKalman<3>(noise_mm, 1e3 * m_per_s2, kRateHz); }, velocity);
  }
}

void add_accelerations(MotionBench& bench, double step_mm) {
  using Fit = rt::AdaptiveWindowVelocity::Fit;
  struct Timed {
    rt::MotionEstimator estimator;
    std::int64_t time_ns = 0;
  };
  bench.add(
      "end fit, 50 Hz", [=] { return Timed{rt::MotionEstimator(step_mm, kRateHz)}; },
      [](Timed& timed, double y) {
        timed.estimator.update(y, timed.time_ns += kPeriodNs);
        return timed.estimator.acceleration_mm_per_s2();
      },
      true);
  for (const double cutoff_hz : {20.0, 100.0}) {
    bench.add(
        "end fit, " + fixed(cutoff_hz, 0) + " Hz",
        [=] { return WindowedAcceleration(step_mm, cutoff_hz, Fit::kEnd); }, kUpdate);
  }
  for (const double cutoff_hz : {50.0, 100.0}) {
    bench.add(
        "best fit, " + fixed(cutoff_hz, 0) + " Hz",
        [=] { return WindowedAcceleration(step_mm, cutoff_hz, Fit::kBest); }, kUpdate);
  }
  bench.add(
      "difference twice", [] { return DifferencedTwice(0, 50.0); }, kUpdate);
  for (const double cutoff_hz : {20.0, 50.0}) {
    bench.add(
        "difference twice, " + fixed(cutoff_hz, 0) + " Hz", [=] { return DifferencedTwice(1, cutoff_hz); },
        kUpdate);
  }
  bench.add(
      "difference twice, 40 Hz twice", [] { return DifferencedTwice(2, 40.0); }, kUpdate);
  const double noise_mm = step_mm / std::sqrt(12.0);
  for (const double m_per_s2 : {0.03, 0.1, 0.3}) {
    bench.add(
        "Kalman α-β-γ, " + significant(m_per_s2, 1) + " m/s² a tick",
        [=] { return SteadyStateKalman<3>(noise_mm, 1e3 * m_per_s2, kRateHz); },
        [](auto& filter, double y) {
          filter.update(y);
          return filter.acceleration_mm_per_s2();
        });
  }
}

double min_error(const std::vector<MethodResult>& results) {
  double least = std::numeric_limits<double>::infinity();
  for (const MethodResult& m : results) least = std::min(least, m.error());
  return least;
}

void show_motions(StudyContext& context, const std::string& stage, const std::string& unit,
                  const std::vector<MotionTrace>& traces, const std::vector<MethodResult>& results) {
  std::vector<std::string> headers{"method"};
  for (std::size_t i = 0; i + 1 < traces.size(); ++i) headers.push_back(traces[i].name + " %");
  for (std::size_t i = 0; i + 1 < traces.size(); ++i) headers.push_back(traces[i].name + " lag ms");
  headers.push_back("at rest, " + unit);
  report::MarkdownTable table(headers);
  for (const MethodResult& result : results) {
    std::vector<std::string> row{result.name + (result.is_default ? " (default)" : "")};
    for (std::size_t i = 0; i + 1 < traces.size(); ++i) {
      row.push_back(fixed(100.0 * result.of_motion[i].error, 1));
    }
    for (std::size_t i = 0; i + 1 < traces.size(); ++i) row.push_back(fixed(result.of_motion[i].lag_ms, 1));
    row.push_back(significant(result.at_rest().rms, 3));
    table.add_row(row);
  }
  context.report.add_table(
      stage + "_motions", "Error and lag by motion: " + stage, table,
      "Error: rms of (estimate - truth) over rms of truth, in per cent. Lag: the shift "
      "of the truth, in steps of 0.1 ms, at which the estimate fits it best. At rest: rms "
      "of (estimate - truth) while a hand holds still.");
}

report::WorkPrecision work_precision(const std::string& stage, const std::vector<MethodResult>& results) {
  report::WorkPrecision all;
  all.stage = stage;
  for (const MethodResult& result : results) {
    all.methods.push_back({result.name, result.error(), result.run_time_ns, result.is_default, {}});
  }
  return all;
}

/// The errors of one method on other motions than those it was tuned to.
struct OtherMotions {
  double gentle = 0.0, violent = 0.0;
};

/// Method, of those that take no longer, that beats the default most; the default if none does.
const MethodResult& best_of(const std::vector<MethodResult>& results, const MethodResult& chosen) {
  const MethodResult* best = &chosen;
  for (const MethodResult& m : results) {
    if (m.run_time_ns <= 1.1 * chosen.run_time_ns && m.error() < best->error()) best = &m;
  }
  return *best;
}

const MethodResult& default_of(const std::vector<MethodResult>& results) {
  return *std::find_if(results.begin(), results.end(), [](const MethodResult& m) { return m.is_default; });
}

/// Margin by which it is beaten, in words.
std::string beaten_by(const std::vector<MethodResult>& results, const std::string& unit) {
  const MethodResult& chosen = default_of(results);
  const MethodResult& best = best_of(results, chosen);
  if (&best == &chosen) return {};
  return best.name + " leaves " + significant(best.error(), 3) + " instead of " +
         significant(chosen.error(), 3) + " at " + fixed(best.run_time_ns, 0) + " instead of " +
         fixed(chosen.run_time_ns, 0) + " ns, at rest " + significant(best.at_rest().rms, 2) +
         " instead of " + significant(chosen.at_rest().rms, 2) + " " + unit + ". ";
}

/// What follows from how the one that beats the default does on other motions.
std::string verdict_on_others(const std::vector<MethodResult>& results,
                              const std::vector<OtherMotions>& others) {
  const MethodResult& chosen = default_of(results);
  const MethodResult& best = best_of(results, chosen);
  const OtherMotions& of_best = others[static_cast<std::size_t>(&best - results.data())];
  const OtherMotions& of_chosen = others[static_cast<std::size_t>(&chosen - results.data())];
  constexpr double kAsGood = 1.1;
  const bool holds =
      of_best.gentle <= kAsGood * of_chosen.gentle && of_best.violent <= kAsGood * of_chosen.violent;
  const std::string numbers = "Where the hand moves gently it leaves " + significant(of_best.gentle, 2) +
                              " against " + significant(of_chosen.gentle, 2) + ", violently " +
                              significant(of_best.violent, 2) + " against " +
                              significant(of_chosen.violent, 2) + ": ";
  return numbers +
         (holds ? "with this encoder it is the better velocity, at the price of its noise at rest. Tried "
                  "in the scenes that explore, it moved their errors of displacement and direction "
                  "both up and down by less than they differ between objects, so what needs no "
                  "assumption on how the hand moves is kept."
                : "a filter has to be reported how the hand will move, the default only the encoder's "
                  "step, and it is kept.");
}

std::string data_remark(double seconds, double step_mm) {
  return "Four motions of " + fixed(seconds, 0) +
         " s at 1 kHz from the simulator (seed 11): taps on a foam ball at 400 mm/s, strokes over a sponge "
         "at up to 150 mm/s, slow waving with tremor, the device shaking itself at 5 Hz and 1 N. Positions "
         "of the tip rounded to " +
         significant(step_mm, 1) +
         " mm. Error: rms of (estimate - truth) at the same tick over rms of truth, lag and noise together; "
         "root mean square over the four motions. Run time for one axis. ";
}

/// Whether methods that were tuned to some motions hold on others.
std::vector<OtherMotions> other_motions(double step_mm, double seconds) {
  std::vector<OtherMotions> others;
  for (const Vigour vigour : {Vigour::kGentle, Vigour::kViolent}) {
    const std::vector<MotionTrace> traces = motion_traces(seconds, vigour);
    MotionBench bench(traces, &MotionTrace::velocity_mm_per_s, step_mm, 0.0);
    add_velocities(bench, step_mm);
    others.resize(bench.results().size());
    for (std::size_t i = 0; i < others.size(); ++i) {
      (vigour == Vigour::kGentle ? others[i].gentle : others[i].violent) = bench.results()[i].error();
    }
  }
  return others;
}

void show_vigour(StudyContext& context, const std::string& stage, const std::vector<MethodResult>& usual,
                 const std::vector<OtherMotions>& others) {
  report::MarkdownTable table({"method", "gentle %", "usual %", "violent %"});
  for (std::size_t i = 0; i < usual.size(); ++i) {
    table.add_row({usual[i].name + (usual[i].is_default ? " (default)" : ""),
                   fixed(100.0 * others[i].gentle, 1), fixed(100.0 * usual[i].error(), 1),
                   fixed(100.0 * others[i].violent, 1)});
  }
  context.report.add_table(
      stage + "_vigour", "Error where the hand moves otherwise: " + stage, table,
      "Gentle: taps at 100 mm/s, strokes at 40 mm/s, waving at 10 mm/s, shaken at 3 Hz and "
      "0.3 N. Violent: taps at 1000 mm/s, strokes at 300 mm/s, waving at 200 mm/s, shaken "
      "at 8 Hz and 3 N. Each method as it was.");
}

}  // namespace

void run_motion_precision(StudyContext& context) {
  const double seconds = context.quick ? 2.0 : 20.0;
  const double timing_s = context.quick ? 0.005 : 0.2;
  const std::vector<MotionTrace> traces = motion_traces(seconds);
  struct Encoder {
    const char* suffix;
    double step_mm;
  };
  for (const auto& [suffix, step_mm] : {Encoder{"", 0.03}, Encoder{"_fine_encoder", 0.007}}) {
    MotionBench velocities(traces, &MotionTrace::velocity_mm_per_s, step_mm, timing_s);
    add_velocities(velocities, step_mm);
    report::WorkPrecision velocity = work_precision(std::string("velocity") + suffix, velocities.results());
    velocity.error_name = "velocity error over rms velocity";
    velocity.remark = data_remark(seconds, step_mm) +
                      "Kalman: standard deviation of the acceleration it reckons with (α-β), or of the "
                      "acceleration's change from tick to tick (α-β-γ).";
    const std::vector<OtherMotions> others = other_motions(step_mm, 0.5 * seconds);
    velocity.justification =
        beaten_by(velocities.results(), "mm/s") + verdict_on_others(velocities.results(), others);
    report::add_work_precision(context.report, velocity);
    show_motions(context, velocity.stage, "mm/s", traces, velocities.results());
    show_vigour(context, velocity.stage, velocities.results(), others);

    MotionBench accelerations(traces, &MotionTrace::acceleration_mm_per_s2, step_mm, timing_s);
    add_accelerations(accelerations, step_mm);
    report::WorkPrecision acceleration =
        work_precision(std::string("acceleration") + suffix, accelerations.results());
    acceleration.error_name = "acceleration error over rms acceleration";
    acceleration.remark = data_remark(seconds, step_mm) +
                          "Run time from the position on, the velocity included. Kalman: standard deviation "
                          "of the acceleration's change from tick to tick.";
    acceleration.justification = beaten_by(accelerations.results(), "mm/s²") +
                                 "The default is kept: the difference is small, and contact is decided "
                                 "without it, on matched inertia.";
    report::add_work_precision(context.report, acceleration);
    show_motions(context, acceleration.stage, "mm/s²", traces, accelerations.results());
    context.report.say(
        "Positions of such encoders do not give the acceleration of taps and strokes to better "
        "than about " +
        fixed(100.0 * min_error(accelerations.results()), 0) +
        " % with any filter tried here: contact is therefore not decided on it.");
  }
}

}  // namespace hapticd::study
