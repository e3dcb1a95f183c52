#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "server/identification/estimate/contact/contact_single_stage.h"
#include "tests/measure/report/run_time.h"
#include "tests/measure/report/work_precision.h"
#include "tests/measure/study/common/plant.h"
#include "tests/measure/study/common/scenes.h"
#include "tests/measure/study/identify/contact_methods.h"
#include "tests/measure/study/precision/log_least_squares.h"
#include "tests/measure/study/precision/precision_study.h"

namespace hapticd::study {

namespace {

using report::fixed;
using report::significant;
using Palpation = std::vector<identification::PalpationSample>;

identification::SingleStageEstimator ungated() {
  identification::SingleStageEstimator::Options options;
  options.min_force_n = 1e-3;
  options.min_share = 0.0;
  options.largest_rate_term = 1e6;
  options.mean_of = 1;
  return identification::SingleStageEstimator(options);
}

struct Candidate {
  std::string label;
  ContactMethod method;
  bool is_default = false;
};

/// What the service offers, the double stage, what was published, and the batch reference.
std::vector<Candidate> candidates() {
  const std::vector<ContactMethod>& shipped = contact_methods();
  return {
      {"recursive as published",
       {"", kHuntCrossley, [](const Palpation& p) { return fit_recursively(LogLeastSquares(), p); }}},
      {"recursive, weighted, ungated",
       {"", kHuntCrossley, [](const Palpation& p) { return fit_recursively(ungated(), p); }}},
      {"recursive, gated", shipped[0]},
      {"double stage", shipped[1]},
      {"variable projection", shipped[2]},
      {"creep law", shipped[3], true},
      {"Ceres", contact_reference()},
  };
}

struct Result {
  double force = std::numeric_limits<double>::quiet_NaN();
  double displacement = std::numeric_limits<double>::quiet_NaN();
  double ns_per_sample = 0.0;
  std::string failed{};
};

Result judged(const Candidate& candidate, const Palpation& training, const TruePalpation& validation) {
  const FittedLaw fitted = candidate.method.fit(training);
  if (!fitted.failed.empty()) return {.failed = fitted.failed};
  const ContactErrors errors = errors_of(fitted, validation);
  return {.force = errors.force, .displacement = errors.displacement};
}

double ns_per_sample(const Candidate& candidate, const Palpation& training, double seconds) {
  return report::run_time_ns(
      training.size(),
      [&] {
        const FittedLaw fitted = candidate.method.fit(training);
        return fitted.creep           ? fitted.creep->max_force_n
               : fitted.hunt_crossley ? fitted.hunt_crossley->stiffness_n_per_mm_m
                                      : 0.0;
      },
      seconds);
}

/// Training and judging data of one object.
struct ObjectData {
  std::string object;
  TruePalpation training;
  TruePalpation validation;
};

/// Presses as a hand mixes them, for as long as wanted: the requests of an identification come in the same
/// order and stop too early to see what length does.
TruePalpation long_palpation(const std::string& object, double duration_s) {
  std::vector<identification::MotionRequest> requests;
  const double forces_n[] = {2.0, 5.0, 3.5, 6.0, 1.2, 4.2};
  const double rates_n_per_s[] = {4.0, 15.0, 2.5, 30.0, 8.0};
  const double holds_s[] = {0.1, 0.5, 0.2};
  // A press with its way there and back takes two seconds or more.
  const auto presses = static_cast<std::size_t>(std::ceil(duration_s / 2.0));
  for (std::size_t i = 0; i < presses; ++i) {
    identification::MotionRequest request;
    request.motion = identification::MotionRequest::Motion::kPress;
    request.force_n = forces_n[i % 6];
    request.force_rate_n_per_s = rates_n_per_s[i % 5];
    request.hold_s = holds_s[i % 3];
    requests.push_back(request);
  }
  return palpate(object, requests, 3);
}

double seconds_in(const Palpation& palpation) {
  return palpation.empty() ? 0.0 : palpation.back().time_s - palpation.front().time_s;
}

void study_methods(StudyContext& context, const std::vector<ObjectData>& data) {
  const std::vector<Candidate> all = candidates();
  report::MarkdownTable table({"object", "method", "force error %", "displacement error %", "ns per sample"});
  report::WorkPrecision stage;
  stage.stage = "identification";
  stage.error_name = "force error on other presses";
  stage.run_time_per = "sample";
  std::vector<std::vector<Result>> results(all.size());
  for (const ObjectData& d : data) {
    for (std::size_t i = 0; i < all.size(); ++i) {
      Result r = judged(all[i], d.training.samples, d.validation);
      if (r.failed.empty()) {
        r.ns_per_sample = ns_per_sample(all[i], d.training.samples, context.quick ? 1e-3 : 0.2);
      }
      table.add_row({d.object, all[i].label, r.failed.empty() ? fixed(100.0 * r.force, 1) : r.failed,
                     fixed(100.0 * r.displacement, 1),
                     r.failed.empty() ? significant(r.ns_per_sample, 3) : report::kNoNumber});
      results[i].push_back(r);
    }
  }
  for (std::size_t i = 0; i < all.size(); ++i) {
    report::Method method{all[i].label};
    method.is_default = all[i].is_default;
    for (const Result& r : results[i]) {
      if (!r.failed.empty()) method.failed = r.failed;
      method.error += r.force / static_cast<double>(data.size());
      method.run_time_ns += r.ns_per_sample / static_cast<double>(data.size());
    }
    stage.methods.push_back(method);
  }
  stage.remark =
      "Mean over " + std::to_string(data.size()) +
      " simulated objects of D§4. Fitted to what a default identification asks for and gets on "
      "phantom_1_5_high_force (seed 1), judged by four other presses up to 5.5 N (seed 7): mean |error| of "
      "the "
      "force over mean force in contact.\nThe simulated objects are no Hunt-Crossley laws, so that law's own "
      "lack is in every error but the creep law's. Run time: of the whole fit, over the samples given.";
  add_stage(context.report, stage);
  context.report.say(
      "All ways to find a Hunt-Crossley law end within a few per cent of each other and of nonlinear least "
      "squares: what is left is the law's own lack. Of the published recursion it is the weighting by f² "
      "that "
      "halves the error; the gates keep the linearisation valid and cost nothing, but gain nothing on "
      "presses "
      "as these. A richer law gains four times what any better fit of the poorer one could.");
  context.report.add_table("precision_identification_objects", "Identification, object by object", table,
                           "Displacement error: mean of |x̂/x - 1| against the truth, beyond a tenth of the "
                           "deepest; as rendering uses the law, from force to displacement.");
}

void study_length(StudyContext& context, const std::vector<std::string>& objects) {
  const std::vector<double> lengths_s =
      context.quick ? std::vector<double>{2.0, 5.0} : std::vector<double>{1, 2, 3, 5, 7, 10, 15, 20, 30};
  const std::vector<Candidate> all = candidates();
  std::vector<std::vector<double>> sums(all.size(), std::vector<double>(lengths_s.size(), 0.0));
  for (const std::string& object : objects) {
    const TruePalpation training = long_palpation(object, lengths_s.back());
    const TruePalpation validation = palpate(object, validation_requests(), 7);
    // Time counts from the first contact: the way there teaches nothing.
    const auto& samples = training.samples;
    const auto first =
        std::find_if(samples.begin(), samples.end(), [](const auto& s) { return s.in_contact; });
    for (std::size_t l = 0; l < lengths_s.size(); ++l) {
      const auto last = std::find_if(first, samples.end(), [&](const identification::PalpationSample& s) {
        return s.time_s > first->time_s + lengths_s[l];
      });
      const Palpation part(samples.begin(), last);
      for (std::size_t i = 0; i < all.size(); ++i) {
        const Result r = judged(all[i], part, validation);
        sums[i][l] += r.force / static_cast<double>(objects.size());
      }
    }
    if (seconds_in({first, samples.end()}) < lengths_s.back())
      report::Report::note(object + ": the palpation is shorter than the longest length");
  }
  report::SvgPlot plot;
  plot.title = "Force error against length of the palpation, mean over the objects";
  plot.x = {"length from the first contact on, pauses included", "s", true};
  plot.y = {"force error on other presses", "%"};
  plot.y.minimum = 0.0;
  plot.y.maximum = 25.0;
  plot.x.minimum = 1.0;
  plot.x.maximum = 30.0;
  for (std::size_t i = 0; i < all.size(); ++i) {
    report::PlotSeries series{all[i].label + (all[i].is_default ? " (default)" : "")};
    series.style = report::PlotSeries::Style::kLinePoints;
    for (std::size_t l = 0; l < lengths_s.size(); ++l) {
      report::Figure figure{"identification_error_by_length",
                            {{"method", all[i].label}, {"length_s", lengths_s[l]}}};
      if (std::isfinite(sums[i][l])) {
        figure.value = sums[i][l];
      } else {
        figure.failed = "not determined on every object";
      }
      context.report.add(figure);
      series.add(lengths_s[l], 100.0 * sums[i][l]);
    }
    plot.series.push_back(series);
  }
  context.report.add_plot("identification_length", plot);
  context.report.say(
      "Every method learns what it can from the first two or three presses (about 5 s), if they differ in "
      "depth "
      "and speed; more of the same teaches next to nothing. Before that no method helps: one press does not "
      "distinguish depth from speed.");
}

}  // namespace

void run_identification_precision(StudyContext& context) {
  std::vector<std::string> objects = explored_objects();
  if (context.quick) objects.resize(1);
  std::vector<ObjectData> data;
  for (const std::string& object : objects) {
    data.push_back({object, requested_palpation(object), palpate(object, validation_requests(), 7)});
  }
  study_methods(context, data);
  study_length(context, objects);
}

}  // namespace hapticd::study
