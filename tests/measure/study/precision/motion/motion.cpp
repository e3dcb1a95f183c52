#include <algorithm>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "rt/signal/adaptive_window_velocity.h"
#include "rt/signal/butterworth_low_pass.h"
#include "rt/signal/motion_estimator.h"
#include "tests/measure/report/run_time.h"
#include "tests/measure/report/work_precision.h"
#include "tests/measure/study/common/parts.h"
#include "tests/measure/study/precision/motion/motion_traces.h"
#include "tests/measure/study/precision/motion/steady_state_kalman.h"

namespace hapticd::study {

namespace {

using report::fixed;
using report::significant;
using Fit = rt::AdaptiveWindowVelocity::Fit;

constexpr double kRateHz = MotionTrace::kRateHz;
constexpr std::int64_t kPeriodNs = 1'000'000;

struct MethodResult {
  std::string name;
  bool is_default = false;
  std::vector<MotionError> of_motion{};
  double run_time_ns = 0.0;

  /// Root mean square over the motions: each counts alike. Rest, the last one, does not count as a motion.
  double error() const {
    double sum = 0.0;
    for (std::size_t i = 0; i + 1 < of_motion.size(); ++i) sum += of_motion[i].error * of_motion[i].error;
    return std::sqrt(sum / static_cast<double>(of_motion.size() - 1));
  }
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
    MethodResult result{name, is_default};
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

/// (y_k - y_{k-1}) / T through a second-order Butterworth low-pass, from rest at zero.
struct FilteredDifference {
  rt::ButterworthLowPass filter{100.0, kRateHz};
  double last_mm = std::nan("");
  double update(double position_mm) noexcept {
    const double step_mm = std::isnan(last_mm) ? 0.0 : position_mm - last_mm;
    last_mm = position_mm;
    return filter.update(step_mm * kRateHz);
  }
};

/// Adaptive windowing by the best fit, the difference of its output, a Butterworth filter.
struct BestFitAcceleration {
  rt::AdaptiveWindowVelocity velocity;
  rt::ButterworthLowPass filter;
  double update(double position_mm) noexcept {
    const double before = velocity.velocity_mm_per_s();
    return filter.update((velocity.update(position_mm) - before) * kRateHz);
  }
};

constexpr auto kUpdate = [](auto& estimator, double y) { return estimator.update(y); };

SteadyStateKalman kalman(double step_mm, double m_per_s2) {
  return {step_mm / std::sqrt(12.0), 1e3 * m_per_s2, kRateHz};
}

std::string kalman_name(double m_per_s2) {
  return "Kalman α-β-γ, " + significant(m_per_s2, 1) + " m/s² a tick";
}

void add_velocities(MotionBench& bench, double step_mm) {
  const auto window = [=](Fit fit) {
    return [=] { return rt::AdaptiveWindowVelocity(step_mm, kRateHz, fit); };
  };
  bench.add("adaptive window, end fit", window(Fit::kEnd), kUpdate, true);
  bench.add("adaptive window, best fit", window(Fit::kBest), kUpdate);
  bench.add(
      "difference, Butterworth 100 Hz", [] { return FilteredDifference{}; }, kUpdate);
  for (const double m_per_s2 : {0.1, 0.3}) {
    bench.add(
        kalman_name(m_per_s2), [=] { return kalman(step_mm, m_per_s2); },
        [](auto& filter, double y) {
          filter.update(y);
          return filter.velocity_mm_per_s();
        });
  }
}

void add_accelerations(MotionBench& bench, double step_mm) {
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
  for (const double cutoff_hz : {50.0, 100.0}) {
    bench.add(
        "best fit, " + fixed(cutoff_hz, 0) + " Hz",
        [=] {
          return BestFitAcceleration{{step_mm, kRateHz, Fit::kBest}, {cutoff_hz, kRateHz}};
        },
        kUpdate);
  }
  bench.add(
      kalman_name(0.03), [=] { return kalman(step_mm, 0.03); },
      [](auto& filter, double y) {
        filter.update(y);
        return filter.acceleration_mm_per_s2();
      });
}

report::WorkPrecision work_precision(const std::string& stage, const std::vector<MethodResult>& results,
                                     double seconds, double step_mm) {
  report::WorkPrecision all;
  all.stage = stage;
  for (const MethodResult& result : results) {
    all.methods.push_back({result.name, result.error(), result.run_time_ns, result.is_default, {}});
  }
  all.remark =
      "Four motions of " + fixed(seconds, 0) +
      " s at 1 kHz from the simulator (seed 11): taps on a foam ball at 400 mm/s, strokes over a sponge "
      "at up to 150 mm/s, slow waving with tremor, the device shaking itself at 5 Hz and 1 N. Positions "
      "of the tip rounded to " +
      significant(step_mm, 1) +
      " mm. Error: rms of (estimate - truth) at the same tick over rms of truth, lag and noise together; "
      "root mean square over the four motions. Run time for one axis, from the position on. Kalman: standard "
      "deviation of the acceleration's change from tick to tick.";
  return all;
}

/// How the methods, which are tuned to some motions, do by motion, at rest and on other motions.
void show_motions(StudyContext& context, const std::string& stage, const std::vector<MotionTrace>& traces,
                  const std::vector<MethodResult>& usual, double step_mm, double seconds) {
  std::vector<std::string> headers{"method"};
  for (std::size_t i = 0; i + 1 < traces.size(); ++i) headers.push_back(traces[i].name + " %");
  headers.insert(headers.end(), {"at rest, mm/s", "gentle %", "violent %"});
  std::vector<std::vector<std::string>> rows;
  for (const MethodResult& result : usual) {
    std::vector<std::string> row{result.name + (result.is_default ? " (default)" : "")};
    for (std::size_t i = 0; i + 1 < traces.size(); ++i)
      row.push_back(fixed(100.0 * result.of_motion[i].error, 1));
    row.push_back(significant(result.of_motion.back().rms, 3));
    rows.push_back(std::move(row));
  }
  for (const Vigour vigour : {Vigour::kGentle, Vigour::kViolent}) {
    const std::vector<MotionTrace> others = motion_traces(seconds, vigour);
    MotionBench bench(others, &MotionTrace::velocity_mm_per_s, step_mm, 0.0);
    add_velocities(bench, step_mm);
    for (std::size_t i = 0; i < rows.size(); ++i)
      rows[i].push_back(fixed(100.0 * bench.results()[i].error(), 1));
  }
  report::MarkdownTable table(headers);
  for (auto& row : rows) table.add_row(std::move(row));
  context.report.add_table(
      stage + "_motions", "Error by motion: " + stage, table,
      "At rest: rms while a hand holds still. Gentle: taps at 100 mm/s, strokes at 40 mm/s, waving at 10 "
      "mm/s, "
      "shaken at 3 Hz and 0.3 N. Violent: taps at 1000 mm/s, strokes at 300 mm/s, waving at 200 mm/s, shaken "
      "at 8 Hz and 3 N. Each method as it was.");
}

}  // namespace

void run_motion_precision(StudyContext& context) {
  const double seconds = context.quick ? 2.0 : 20.0;
  const double timing_s = context.quick ? 0.005 : 0.2;
  const std::vector<MotionTrace> traces = motion_traces(seconds);
  for (const auto& [suffix, step_mm] : {std::pair{"", 0.03}, {"_fine_encoder", 0.007}}) {
    MotionBench velocities(traces, &MotionTrace::velocity_mm_per_s, step_mm, timing_s);
    add_velocities(velocities, step_mm);
    report::WorkPrecision velocity =
        work_precision(std::string("velocity") + suffix, velocities.results(), seconds, step_mm);
    velocity.error_name = "velocity error over rms velocity";
    velocity.justification =
        "a filter has to be told how the hand will move, as its errors on gentle and violent motions show; "
        "the "
        "default knows only the encoder's step.";
    report::add_work_precision(context.report, velocity);
    show_motions(context, velocity.stage, traces, velocities.results(), step_mm, 0.5 * seconds);

    MotionBench accelerations(traces, &MotionTrace::acceleration_mm_per_s2, step_mm, timing_s);
    add_accelerations(accelerations, step_mm);
    report::WorkPrecision acceleration =
        work_precision(std::string("acceleration") + suffix, accelerations.results(), seconds, step_mm);
    acceleration.error_name = "acceleration error over rms acceleration";
    acceleration.justification =
        "the difference is small, and contact is decided without it, on matched inertia, since no filter "
        "tried "
        "gets the acceleration of taps and strokes from such an encoder.";
    report::add_work_precision(context.report, acceleration);
  }
}

}  // namespace hapticd::study
