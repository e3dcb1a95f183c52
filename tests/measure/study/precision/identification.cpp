#include <limits>
#include <string>
#include <vector>

#include "server/identification/estimate/contact/contact_single_stage.h"
#include "tests/measure/report/run_time.h"
#include "tests/measure/report/work_precision.h"
#include "tests/measure/study/common/parts.h"
#include "tests/measure/study/common/plant.h"
#include "tests/measure/study/common/scenes.h"
#include "tests/measure/study/identify/contact_methods.h"
#include "tests/measure/study/precision/log_least_squares.h"

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

}  // namespace

void run_identification_precision(StudyContext& context) {
  std::vector<std::string> objects = explored_objects();
  if (context.quick) objects.resize(1);
  std::vector<ObjectData> data;
  for (const std::string& object : objects) {
    data.push_back({object, requested_palpation(object), palpate(object, validation_requests(), 7)});
  }
  study_methods(context, data);
}

}  // namespace hapticd::study
