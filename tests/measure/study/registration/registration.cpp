#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <string>
#include <vector>

#include "server/calibration/estimate/nominal_arm.h"
#include "tests/measure/study/common/parts.h"
#include "tests/support/calibration/registration_trial.h"

namespace hapticd::study {

namespace {

using calibration::FitMethod;
using report::fixed;

struct Method {
  const char* name;
  FitMethod method;
};
constexpr std::array<Method, 4> kMethods{
    Method{"rigid", FitMethod::kRigid}, Method{"rigid_latency", FitMethod::kRigidLatency},
    Method{"arm_without_latency", FitMethod::kArmNoLatency}, Method{"arm_and_latency", FitMethod::kArm}};
constexpr double kDegPerRad = 57.29577951308232;
constexpr const char* kSource = "services around the loop: visual systems";

/// Outcome of one arm by one method.
struct Outcome {
  TargetErrors errors;
  double latency_error_ms = 0.0;
  double run_time_ns = 0.0;
  std::string failed;
};

Outcome outcome_of(const RegistrationTrial& trial, FitMethod method) {
  Outcome outcome;
  const auto began = std::chrono::steady_clock::now();
  const auto nominal = calibration::find_nominal_arm(trial.rig.poses());
  const auto fit = calibration::fit_arm(trial.rig, trial.reference, nominal.arm, {.method = method});
  outcome.run_time_ns =
      std::chrono::duration<double, std::nano>(std::chrono::steady_clock::now() - began).count();
  if (!fit) {
    outcome.failed = fit.error().text();
    return outcome;
  }
  outcome.errors = judge(trial, *fit);
  outcome.latency_error_ms = 1e3 * (fit->latency_s - trial.latency_s);
  return outcome;
}

double quantile(std::vector<double> values, double share) {
  if (values.empty()) return NAN;
  std::sort(values.begin(), values.end());
  return values[std::min(values.size() - 1,
                         static_cast<std::size_t>(share * static_cast<double>(values.size())))];
}

struct Column {
  std::vector<double> median_mm, tail_mm, ratio, turn_deg, latency_ms, time_ns;
  std::size_t failed = 0;

  void add(const Outcome& o) {
    if (!o.failed.empty()) {
      ++failed;
      return;
    }
    median_mm.push_back(o.errors.median_mm);
    tail_mm.push_back(o.errors.quantile_95_mm);
    ratio.push_back(o.errors.predicted_rms_mm / o.errors.rms_mm);
    turn_deg.push_back(kDegPerRad * o.errors.orientation_95_rad);
    latency_ms.push_back(std::abs(o.latency_error_ms));
    time_ns.push_back(o.run_time_ns);
  }
};

void add_figure(StudyContext& context, const char* name, report::Case conditions, double value,
                const char* unit, std::optional<double> goal, std::optional<double> time_ns = {}) {
  report::Figure figure{name, std::move(conditions)};
  if (std::isfinite(value)) figure.value = value;
  if (!std::isfinite(value)) figure.failed = "no calibration";
  figure.unit = unit;
  figure.goal = goal;
  figure.run_time_ns = time_ns;
  if (goal) figure.source = kSource;
  context.report.add(figure);
}

}  // namespace

void run_registration(StudyContext& context) {
  const std::uint64_t arms = context.quick ? 2 : 30;
  std::array<Column, kMethods.size()> columns;
  for (std::uint64_t seed = 1; seed <= arms; ++seed) {
    const RegistrationTrial trial =
        record_trial({.seed = seed, .calibration_s = context.quick ? 30.0 : 60.0, .held_out_s = 20.0});
    for (std::size_t m = 0; m < kMethods.size(); ++m) columns[m].add(outcome_of(trial, kMethods[m].method));
  }
  report::MarkdownTable table({"method", "median mm", "95 % mm", "worst arm's 95 % mm",
                               "predicted / observed", "orientation 95 %, °", "latency error ms, worst"});
  for (std::size_t m = 0; m < kMethods.size(); ++m) {
    const Column& c = columns[m];
    const bool all = kMethods[m].method == FitMethod::kArm;
    const auto goal = [all](double value) { return all ? std::optional<double>(value) : std::nullopt; };
    const report::Case method{{"method", kMethods[m].name}};
    const auto with = [&method](const char* name, const char* value) {
      report::Case c2{{name, value}};
      c2.insert(c2.end(), method.begin(), method.end());
      return c2;
    };
    const double time_ns = quantile(c.time_ns, 0.5);
    add_figure(context, "target_error_mm", with("quantile", "median"), quantile(c.median_mm, 0.5), "mm",
               goal(0.5), time_ns);
    add_figure(context, "target_error_mm", with("quantile", "95 %"), quantile(c.tail_mm, 0.5), "mm",
               goal(1.0), time_ns);
    add_figure(context, "target_error_mm", with("quantile", "95 %, worst arm"), quantile(c.tail_mm, 1.0),
               "mm", goal(1.0), time_ns);
    add_figure(context, "predicted_over_observed", with("of", "median arm"), quantile(c.ratio, 0.5), "1",
               goal(1.0));
    add_figure(context, "predicted_over_observed", with("of", "lowest arm"), quantile(c.ratio, 0.0), "1",
               goal(0.8));
    add_figure(context, "predicted_over_observed", with("of", "highest arm"), quantile(c.ratio, 1.0), "1",
               goal(1.2));
    const auto within =
        std::count_if(c.ratio.begin(), c.ratio.end(), [](double r) { return r >= 0.8 && r <= 1.2; });
    add_figure(context, "predicted_within_20_percent", method,
               static_cast<double>(within) / static_cast<double>(arms), "1", goal(1.0));
    add_figure(context, "registration_orientation_error_deg", with("quantile", "95 %, worst arm"),
               quantile(c.turn_deg, 1.0), "°", goal(0.5));
    add_figure(context, "calibrations_failed", method, static_cast<double>(c.failed), "1", goal(0.0));
    const bool late = kMethods[m].method == FitMethod::kArm || kMethods[m].method == FitMethod::kRigidLatency;
    if (late) {
      add_figure(context, "latency_error_ms", with("of", "median arm"), quantile(c.latency_ms, 0.5), "ms",
                 goal(0.5));
      add_figure(context, "latency_error_ms", with("of", "worst arm"), quantile(c.latency_ms, 1.0), "ms",
                 goal(0.5));
    }
    table.add_row({kMethods[m].name, fixed(quantile(c.median_mm, 0.5), 3), fixed(quantile(c.tail_mm, 0.5), 3),
                   fixed(quantile(c.tail_mm, 1.0), 3),
                   fixed(quantile(c.ratio, 0.0), 2) + " … " + fixed(quantile(c.ratio, 0.5), 2) + " … " +
                       fixed(quantile(c.ratio, 1.0), 2),
                   fixed(quantile(c.turn_deg, 1.0), 3), late ? fixed(quantile(c.latency_ms, 1.0), 3) : "-"});
  }
  context.report.add_table("registration", "Target error on held-out motion", table,
                           std::to_string(arms) +
                               " arms: gains 1 %, zeros 1°, links 0.5 mm, gimbal 1 % and 2°, play 0.2°, sag "
                               "0.3 mm, ripple 0.04°; tracker "
                               "60 Hz, 0.25 … 0.35 mm, latency 10 … 40 ms, 1 % outliers, 3 % drop-outs. "
                               "Quantiles over the motion; in the "
                               "median over the arms unless it says worst.");
}

}  // namespace hapticd::study
