#include "tests/measure/study/extremes/information.h"

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <string>

#include "hal/sim/base/random.h"
#include "rt/deformation/fused_displacement.h"
#include "rt/deformation/tracked_direction.h"
#include "rt/signal/vector.h"
#include "server/identification/estimate/contact/contact_single_stage.h"
#include "tests/measure/study/extremes/extreme.h"
#include "tests/measure/study/extremes/palpated.h"
#include "tests/measure/study/extremes/textbook_rls.h"
#include "tests/reference/contact_double_stage.h"

namespace hapticd::study::extremes {

namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kForgetting = 0.9997;
constexpr double kNoiseN = 0.003;
constexpr double kMaxDepthMm = 4.0;
constexpr rt::HuntCrossleyParameters kLaw{0.4, 4e-4, 1.5};

/// Seconds of holding still at which a course is looked at: six a decade, up to ten hours.
std::vector<double> looked_at_s(bool quick) {
  std::vector<double> times;
  const double end = quick ? 360.0 : 36'000.0;
  for (double t = 1.0; t < end; t *= std::pow(10.0, 1.0 / 6.0)) times.push_back(t);
  times.push_back(end);
  return times;
}

constexpr std::size_t kColumns = 4;
using Look = std::array<double, kColumns>;  // in the order of InformationCourse

double error_of(double stiffness, double exponent) {
  const double force = rt::hunt_crossley_force_n(kLaw, 0.5 * kMaxDepthMm, 0.0);
  return std::abs(std::pow(force / stiffness, 1.0 / exponent) / (0.5 * kMaxDepthMm) - 1.0);
}
double error_of(const std::optional<identification::HuntCrossleyEstimate>& found) {
  return found ? error_of(found->parameters.stiffness_n_per_mm_m, found->parameters.exponent) : kNan;
}

/// Palpation, holding still, palpation; flat: all looks, then the error afterwards.
template <class Add, class Report>
report::CellValues course_of(bool quick, const Add& add, const Report& fill_record) {
  const auto palpate = [&](std::uint64_t seed) {
    for (const identification::PalpationSample& s : palpated(kLaw, kMaxDepthMm, 20.0, kNoiseN, seed)) add(s);
  };
  palpate(1);
  sim::Random random(2);
  identification::PalpationSample held;
  held.displacement_mm = 0.6 * kMaxDepthMm;
  held.in_contact = true;
  const double force = rt::hunt_crossley_force_n(kLaw, held.displacement_mm, 0.0);
  report::CellValues values;
  long tick = 0;
  for (const double until_s : looked_at_s(quick)) {
    for (; tick < std::lround(1e3 * until_s); ++tick) {
      held.normal_force_n = force + kNoiseN * random.normal();
      held.time_s = 20.0 + 1e-3 * static_cast<double>(tick);
      add(held);
    }
    const Look look = fill_record();
    values.insert(values.end(), look.begin(), look.end());
  }
  palpate(3);
  values.push_back(fill_record()[3]);
  return values;
}

report::CellValues textbook(bool quick) {
  constexpr double kFirst = 100.0;
  TextbookRls rls(kForgetting, kFirst);
  return course_of(
      quick,
      [&](const identification::PalpationSample& s) {
        if (s.normal_force_n > 0.1) {
          rls.add({1.0, std::log(s.displacement_mm), s.rate_mm_per_s}, std::log(s.normal_force_n));
        }
      },
      [&]() -> Look {
        Eigen::Matrix3d p;
        for (int i = 0; i < 3; ++i) {
          for (int j = 0; j < 3; ++j)
            p(i, j) = rls.covariance()[static_cast<std::size_t>(i)][static_cast<std::size_t>(j)];
        }
        if (!p.allFinite()) return {kNan, kNan, kNan, kNan};
        const Eigen::Matrix3d symmetric = 0.5 * (p + p.transpose());
        const Eigen::Vector3d values =
            Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(symmetric, Eigen::EigenvaluesOnly).eigenvalues();
        return {p.cwiseAbs().maxCoeff() / kFirst, values.minCoeff(),
                values.cwiseAbs().maxCoeff() / values.cwiseAbs().minCoeff(),
                error_of(std::exp(rls.parameters()[0]), rls.parameters()[1])};
      });
}

report::CellValues double_stage(bool quick) {
  identification::DoubleStageEstimator estimator;
  return course_of(
      quick, [&](const identification::PalpationSample& s) { estimator.add(s); },
      [&]() -> Look {
        return {estimator.covariance_share(), kNan, kNan, error_of(estimator.estimate())};
      });
}

report::CellValues single_stage(bool quick) {
  identification::SingleStageEstimator::Options options;
  options.forgetting = kForgetting;
  identification::SingleStageEstimator estimator(options);
  return course_of(
      quick, [&](const identification::PalpationSample& s) { estimator.add(s); },
      [&]() -> Look {
        return {kNan, kNan, kNan, error_of(estimator.estimate())};
      });
}

report::CellValues single_stage_shipped(bool quick) {
  identification::SingleStageEstimator estimator;
  return course_of(
      quick, [&](const identification::PalpationSample& s) { estimator.add(s); },
      [&]() -> Look {
        return {kNan, kNan, kNan, error_of(estimator.estimate())};
      });
}

report::CellValues fused(bool quick) {
  rt::FusedDisplacement displacement(0.05, kNoiseN, 1000.0);
  constexpr double kFirst = 0.05;
  displacement.begin(0.0, kFirst);
  double truth = 0.0;
  return course_of(
      quick,
      [&](const identification::PalpationSample& s) {
        const double way = s.displacement_mm - truth;
        truth = s.displacement_mm;
        displacement.update(way, 0.1 * std::abs(way),
                            rt::hunt_crossley_displacement(kLaw, s.normal_force_n, s.rate_mm_per_s));
      },
      [&]() -> Look {
        const double variance = displacement.deviation_mm() * displacement.deviation_mm();
        return {variance / (kFirst * kFirst), variance, 1.0,
                std::abs(displacement.displacement_mm() / truth - 1.0)};
      });
}

report::CellValues tracked(bool quick) {
  rt::TrackedDirection direction({0.3, 0.3, 0.0}, kNoiseN, 1000.0);
  direction.begin({0.0, 0.0, 0.1});
  const double first = direction.deviation_rad() * direction.deviation_rad();
  double before = 0.0;
  return course_of(
      quick,
      [&](const identification::PalpationSample& s) {
        direction.update({0.0, 0.0, s.normal_force_n}, {0.0, 0.0, before - s.displacement_mm},
                         {0.0, 0.0, -s.rate_mm_per_s});
        before = s.displacement_mm;
      },
      [&]() -> Look {
        const double variance = direction.deviation_rad() * direction.deviation_rad();
        const hal::Vector3& n = direction.normal();
        return {variance / first, variance, kNan, std::atan2(std::hypot(n.x, n.y), n.z)};
      });
}

struct Estimator {
  const char* name;
  report::CellValues (*run)(bool quick);
};
constexpr std::array kEstimators{
    Estimator{"textbook RLS, λ 0.9997 (not used)", textbook},
    Estimator{"recursive double stage, λ 0.9997", double_stage},
    Estimator{"recursive single stage, λ 0.9997", single_stage},
    Estimator{"recursive single stage, λ 1 (default)", single_stage_shipped},
    Estimator{"fused displacement", fused},
    Estimator{"tracked direction", tracked},
};

std::string shown(double value) {
  if (!std::isfinite(value)) return report::kNoNumber;
  char text[32];
  std::snprintf(text, sizeof text, "%.2g", value);
  return text;
}

}  // namespace

std::optional<Information> information_over_time(StudyContext& context) {
  const bool quick = context.quick;
  const auto values = context.cells.values("extremes_information", kEstimators.size(),
                                           [&](std::size_t i) { return kEstimators[i].run(quick); });
  if (!values) return std::nullopt;
  Information information{looked_at_s(quick), {}};
  for (std::size_t i = 0; i < kEstimators.size(); ++i) {
    const report::CellValues& flat = (*values)[i];
    InformationCourse course;
    course.name = kEstimators[i].name;
    for (std::size_t at = 0; at + kColumns < flat.size(); at += kColumns) {
      course.variance_share.push_back(flat[at]);
      course.smallest_eigenvalue.push_back(flat[at + 1]);
      course.condition.push_back(flat[at + 2]);
      course.error.push_back(flat[at + 3]);
    }
    course.error_afterwards = flat.back();
    information.courses.push_back(course);
  }
  return information;
}

void show_information(StudyContext& context, const Information& information) {
  report::SvgPlot plot;
  plot.title = "Largest variance while nothing happens";
  plot.x = {"time of holding still", "s", true};
  plot.y = {"largest variance over the first", "1", true};
  plot.y.maximum = 1e20;
  plot.y.minimum = 1e-6;
  plot.height_px = 380;
  report::MarkdownTable table({"estimator", "still for", "largest variance", "smallest eigenvalue",
                               "condition number", "error of what it gives"});
  for (const InformationCourse& course : information.courses) {
    const bool textbook = &course == &information.courses.front();
    if (std::any_of(course.variance_share.begin(), course.variance_share.end(),
                    [](double v) { return std::isfinite(v); })) {
      report::PlotSeries series{course.name, information.time_s, course.variance_share};
      series.dashed = textbook;
      if (textbook) series.colour = 1;
      if (!textbook)
        series.colour = std::string(course.name).find("double") != std::string::npos ? 0
                        : &course == &information.courses.back()                     ? 2
                                                                                     : 4;
      plot.series.push_back(series);
    }
    for (const double at_s : {1.0, 100.0, 1000.0, 36'000.0}) {
      const auto near = std::min_element(
          information.time_s.begin(), information.time_s.end(),
          [&](double a, double b) { return std::abs(std::log(a / at_s)) < std::abs(std::log(b / at_s)); });
      if (std::abs(*near / at_s - 1.0) > 0.01) continue;
      const auto i = static_cast<std::size_t>(near - information.time_s.begin());
      table.add_row({course.name, report::significant(*near) + " s", shown(course.variance_share[i]),
                     shown(course.smallest_eigenvalue[i]), shown(course.condition[i]),
                     shown(course.error[i])});
    }
    table.add_row({course.name, "excited again", "", "", "", shown(course.error_afterwards)});
    report::Figure figure{
        "extreme_error", {{"stage", course.name}, {"extreme", "ten hours without excitation, then excited"}}};
    figure.source = "10 %: an estimator that the rest has not spoilt";
    figure.goal = 0.1;
    if (std::isfinite(course.error_afterwards)) {
      figure.value = course.error_afterwards;
    } else {
      figure.failed = "its covariance has overflowed";
    }
    context.report.add(figure);
  }
  context.report.add_plot("extremes_information", plot);
  context.report.add_table("extremes_information", "Recursive estimators without excitation", table,
                           "20 s of presses, then one depth held, then 20 s of presses; force noise 3 mN. "
                           "The error is that of the "
                           "displacement at half the depth (of the direction, in rad).");
  context.report.say(
      "Textbook recursive least squares with forgetting winds up: its covariance grows by 1/λ a tick where "
      "nothing excites it, loses definiteness to rounding, and overflows. What ships cannot: the single "
      "stage keeps sums instead of a covariance and refuses to answer where they say nothing, the double "
      "stage bounds its covariances, filters of displacement and direction have bounded variances.");
}

}  // namespace hapticd::study::extremes
