#include <cmath>
#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "server/identification/estimate/friction/friction_law_fit.h"
#include "server/identification/estimate/friction/maxwell_slip_fit.h"
#include "tests/measure/study/common/parts.h"
#include "tests/measure/study/common/recording_set.h"
#include "tests/measure/study/identify/recordings/friction_recording.h"
#include "tests/support/value_of.h"

namespace hapticd::study {

namespace {

using report::fixed;
using test::value_of;

constexpr const char* kReciprocating = "reciprocating_friction";
constexpr const char* kSeal = "seal_friction";

double parameter(const rt::IdentifiedModel& model, const std::string& name) {
  for (const rt::EstimatedParameter& p : model.parameters) {
    if (p.name == name) return p.value;
  }
  return std::nan("");
}

/// A law as fitted to one part: predicts any other.
struct FittedLaw {
  std::function<std::vector<double>(const std::vector<identification::FrictionRow>&)> predict;
  double bias_n = 0.0;
};

FittedLaw fit_law(const std::string& law, const FrictionRecording& part) {
  if (law == "maxwell_slip") {
    const auto fit = value_of(identification::fit_maxwell_slip(rows_of(part), {.bias = true}));
    return {[fit](const auto& rows) { return identification::predicted_friction_n(rows, fit); }, fit.bias_n};
  }
  identification::FrictionTask task;
  task.exponent = law == "dahl_exponent";
  task.exponent_is_one = law == "dahl";
  const auto model = value_of(identify_recording(part, task));
  const rt::FrictionParameters p = std::get<rt::FrictionModel>(model.content).friction;
  const double bias_n = parameter(model, "force_bias_n");
  return {[p, bias_n](const auto& rows) {
            return identification::predicted_friction_n(rows, p, rt::FrictionLaw::kDahl, bias_n);
          },
          bias_n};
}

/// Sums that make rms left over rms of the friction, the law's offset subtracted.
struct Residual {
  double left = 0.0;
  double whole = 0.0;
  double value() const { return std::sqrt(left / whole); }
  void add(const FittedLaw& law, const FrictionRecording& part) {
    const std::vector<identification::FrictionRow> rows = rows_of(part);
    const std::vector<double> predicted = law.predict(rows);
    for (std::size_t i = 0; i < rows.size(); ++i) {
      if (!rows[i].settled) continue;
      const double friction_n = rows[i].friction_n - law.bias_n;
      left += (predicted[i] - rows[i].friction_n) * (predicted[i] - rows[i].friction_n);
      whole += friction_n * friction_n;
    }
  }
};

void study_reciprocating(StudyContext& context, const std::filesystem::path& folder) {
  const FrictionRecording whole = read_friction_recording(folder / kReciprocating / "first_half.csv");
  double loaded_s = 0.0;
  for (const RecordedFriction& r : whole) {
    if (r.normal_n < 4.9) loaded_s = r.time_s;
  }
  const double end_s = whole.back().time_s;
  const double middle_s = 0.5 * (loaded_s + end_s);
  const FrictionRecording halves[2] = {part_of(whole, loaded_s, middle_s), part_of(whole, middle_s, end_s)};
  report::MarkdownTable table({"law", "across %", "goal %"});
  for (const auto& [law, goal] :
       {std::pair{"dahl", 0.11}, {"dahl_exponent", 0.05}, {"maxwell_slip", 0.05}, {"identified", 0.05}}) {
    Residual across;
    for (int h = 0; h < 2; ++h) across.add(fit_law(law, halves[h]), halves[1 - h]);
    report::Figure figure{"recording_residual", {{"set", kReciprocating}, {"law", law}, {"split", "across"}}};
    figure.value = across.value();
    figure.goal = goal;
    figure.source = "rms left over rms of friction";
    context.report.add(figure);
    table.add_row({law, fixed(100.0 * across.value(), 2), fixed(100.0 * goal, 0)});
  }
  context.report.add_table(
      "friction_recordings", "Reciprocating friction: what the laws leave", table,
      "Halves of the recording (12 cycles each): fitted to one, judged on the other; every "
      "instant counts. An offset of the friction channel is part of each law.");
}

void study_seal(StudyContext& context, const std::filesystem::path& folder) {
  report::MarkdownTable table({"file", "level N", "published N", "error %"});
  for (const auto& [name, published_n] :
       {std::pair{"O-ring_1bar", 5.6}, {"O-ring_3bar", 7.5}, {"O-ring_5bar", 9.0}}) {
    const auto model = value_of(
        identify_recording(read_friction_recording(folder / kSeal / (std::string(name) + ".csv")), {}));
    const double level_n = parameter(model, "coulomb_force_n");
    report::Figure figure{"recording_coulomb_error",
                          {{"set", kSeal}, {"file", name}, {"against", "published level"}}};
    figure.goal = 0.05;
    figure.source = "published: half the difference between directions, 5.6 / 7.5 / 9.0 N";
    figure.value = std::abs(level_n / published_n - 1.0);
    context.report.add(figure);
    table.add_row({name, fixed(level_n, 2), fixed(published_n, 1), fixed(100.0 * *figure.value, 1)});
  }
  context.report.add_table("friction_seals", "Seal friction: Coulomb levels", table,
                           "Force = pressure × area + friction: the level is half the difference between the "
                           "directions, as published; the normal force is not known.");
}

}  // namespace

void run_identify_friction_recordings(StudyContext& context) {
  const auto folder = recordings_folder();
  if (!folder) return report::Report::note("no friction recordings: " + no_recordings_reason());
  study_reciprocating(context, *folder);
  study_seal(context, *folder);
}

}  // namespace hapticd::study
