#include <cmath>
#include <string>
#include <vector>

#include "tests/measure/study/common/explore_study.h"
#include "tests/measure/study/common/parts.h"
#include "tests/measure/study/common/rig_study.h"
#include "tests/measure/study/stability/scaled_object.h"
#include "tests/measure/study/stability/stability_trial.h"

namespace hapticd::study {

namespace {

constexpr const char* kPressedBall = "rubber_ball_3d";
constexpr double kSoftestAdded = 0.05;  // N/mm
constexpr double kStiffestAdded = 50.0;
constexpr double kDepthMm = 25.0;  // of the inclusion's centre, as in the phantoms of D§5

/// The object as it is, with an inclusion straight below the press that adds a spring of so many N/mm.
StabilityTrial inclusion_trial(const std::string& device, double object_n_per_mm,
                               rt::InclusionVariant variant, double added_n_per_mm) {
  StabilityTrial trial =
      explore_trial(device, scaled_object(kPressedBall, object_n_per_mm),
                    scaled_model(identified(kPressedBall).model, kPressedBall, object_n_per_mm));
  trial.scene.explore.modulated = false;
  trial.scene.compensation.back_drive = false;
  rt::InclusionParameters inclusion;
  inclusion.variant = variant;
  inclusion.surface_mm = {0.0, 0.0, 0.0};
  inclusion.place_mm = {0.0, 0.0, -kDepthMm};
  inclusion.response = {added_n_per_mm, 0.0, 1.0};
  trial.scene.inclusions = {inclusion};
  return trial;
}

struct InclusionCase {
  std::string device;
  double object_n_per_mm = 0.0;
  rt::InclusionVariant variant = rt::InclusionVariant::kEnergy;

  StabilityClass verdict(double added_n_per_mm) const {
    return run_trial(inclusion_trial(device, object_n_per_mm, variant, added_n_per_mm), object_n_per_mm)
        .verdict;
  }
};

/// Largest stable added stiffness, whether it is an end of the search, and what happens beyond it.
std::vector<double> stiffest_stable(const InclusionCase& one) {
  constexpr int kBisections = 4;  // a doubling to 4.5 %
  double stable = 0.0;
  double unstable = 0.0;
  StabilityClass beyond = StabilityClass::kStable;
  for (double added = kSoftestAdded; added <= kStiffestAdded && unstable == 0.0; added *= 2.0) {
    beyond = one.verdict(added);
    (is_stable(beyond) ? stable : unstable) = added;
  }
  if (unstable == 0.0) return {stable, 0.0, static_cast<double>(beyond)};
  for (int i = 0; i < kBisections && stable > 0.0; ++i) {
    const double middle = std::sqrt(stable * unstable);
    const StabilityClass verdict = one.verdict(middle);
    if (is_stable(verdict)) {
      stable = middle;
    } else {
      unstable = middle;
      beyond = verdict;
    }
  }
  return {stable, 1.0, static_cast<double>(beyond)};
}

}  // namespace

void run_inclusion_stability(StudyContext& context) {
  using report::significant;
  std::vector<InclusionCase> cases;
  for (const std::string& device : sim::device_preset_names()) {
    for (const double object :
         context.quick ? std::vector<double>{0.13} : std::vector<double>{0.13, 0.5, 2.0, 8.0}) {
      for (const auto variant : {rt::InclusionVariant::kEnergy, rt::InclusionVariant::kPublished}) {
        cases.push_back({device, object, variant});
      }
    }
  }
  const auto cells = context.cells.values("stability_inclusion", cases.size(),
                                          [&](std::size_t cell) { return stiffest_stable(cases[cell]); });
  if (!cells) return;
  report::MarkdownTable table({"device", "object N/mm", "variant", "stable to N/mm added", "beyond"});
  for (std::size_t i = 0; i < cases.size(); ++i) {
    const InclusionCase& one = cases[i];
    const std::vector<double>& found = (*cells)[i];
    const bool published = one.variant == rt::InclusionVariant::kPublished;
    const bool is_end = found[1] == 0.0;
    table.add_row(
        {one.device, significant(one.object_n_per_mm, 2), published ? "published" : "energy",
         (is_end ? "≥ " : "") + significant(found[0], 3),
         is_end ? "" : std::string(to_text(static_cast<StabilityClass>(static_cast<int>(found[2]))))});
    report::Figure figure{"inclusion_max_stable_n_per_mm",
                          {{"device", one.device},
                           {"object_n_per_mm", significant(one.object_n_per_mm, 2)},
                           {"variant", published ? "published" : "energy"}}};
    figure.value = found[0];
    figure.unit = "N/mm";
    figure.source = is_end ? "stable to the end of the search" : "unstable beyond";
    context.report.add(figure);
  }
  context.report.add_table(
      "stability_inclusion", "Stiffest stable inclusion", table,
      std::string("Added to the object by a spring-like inclusion straight below the press, 25 mm deep. ") +
          kTrialInWords);
}

}  // namespace hapticd::study
