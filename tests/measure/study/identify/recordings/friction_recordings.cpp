#include <array>
#include <cmath>
#include <functional>
#include <optional>

#include "server/identification/estimate/friction/friction_law_fit.h"
#include "server/identification/estimate/friction/maxwell_slip_fit.h"
#include "tests/measure/study/common/parts.h"
#include "tests/measure/study/common/recording_set.h"
#include "tests/measure/study/identify/recordings/friction_recording.h"
#include "tests/support/value_of.h"

namespace hapticd::study {

namespace {

using test::value_of;

using report::fixed;
using report::significant;

constexpr const char* kReciprocating = "reciprocating_friction";
constexpr const char* kSeal = "seal_friction";

double parameter(const rt::IdentifiedModel& model, const std::string& name, bool error = false) {
  for (const rt::EstimatedParameter& p : model.parameters) {
    if (p.name == name) return error ? p.standard_error : p.value;
  }
  return std::nan("");
}

std::string with_error(double value, double error) {
  return significant(value) + " ± " + significant(error, 1);
}

/// A law as fitted to one part: predicts any other.
using Prediction = std::function<std::vector<double>(const std::vector<identification::FrictionRow>&)>;
struct FittedLaw {
  Prediction predict;
  double bias_n = 0.0;
  std::string words;  ///< its parameters
};

FittedLaw fit_law(const std::string& law, const FrictionRecording& part) {
  FittedLaw fitted;
  if (law == "maxwell_slip") {
    const auto fit = value_of(identification::fit_maxwell_slip(rows_of(part), {.bias = true}));
    fitted.bias_n = fit.bias_n;
    fitted.predict = [fit](const std::vector<identification::FrictionRow>& rows) {
      return identification::predicted_friction_n(rows, fit);
    };
    for (std::size_t i = 0; i < fit.parameters.reach_mm.size(); ++i) {
      if (!(fit.parameters.reach_mm[i] > 0.0)) continue;
      fitted.words += (fitted.words.empty() ? "reach mm/stiffness 1/mm: " : ", ") +
                      significant(fit.parameters.reach_mm[i], 2) + "/" +
                      significant(fit.parameters.stiffness_per_mm[i], 2);
    }
    fitted.words += "; μ_k " + significant(fit.parameters.kinetic());
    return fitted;
  }
  identification::FrictionTask task;
  task.exponent = law == "dahl_exponent";
  task.exponent_is_one = law == "dahl";
  const auto model = value_of(identify_recording(part, task));
  const rt::FrictionParameters p = std::get<rt::FrictionModel>(model.content).friction;
  const double bias_n = parameter(model, "force_bias_n");
  fitted.bias_n = bias_n;
  fitted.predict = [p, bias_n](const std::vector<identification::FrictionRow>& rows) {
    return identification::predicted_friction_n(rows, p, rt::FrictionLaw::kDahl, bias_n);
  };
  fitted.words = "μ_k " + with_error(p.kinetic, parameter(model, "kinetic", true)) + ", δ " +
                 with_error(p.presliding_mm, parameter(model, "presliding_mm", true)) + " mm, μ_b " +
                 with_error(p.viscous_n_s_per_mm, parameter(model, "viscous_n_s_per_mm", true)) +
                 " N·s/mm, offset " + with_error(bias_n, parameter(model, "force_bias_n", true)) + " N";
  if (p.exponent != 1.0) fitted.words += ", i " + with_error(p.exponent, parameter(model, "exponent", true));
  return fitted;
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

void add_residual(StudyContext& context, const std::string& set, const std::string& law,
                  const std::string& split, double value, std::optional<double> goal,
                  std::optional<double> reference) {
  report::Figure figure{"recording_residual", {{"set", set}, {"law", law}, {"split", split}}};
  figure.value = value;
  figure.goal = goal;
  figure.reference = reference;
  figure.source = "rms left over rms of friction; reference: least squares of others on the same file";
  context.report.add(figure);
}

void plot_loop(StudyContext& context, const FrictionRecording& judged,
               const std::vector<std::pair<std::string, FittedLaw>>& laws) {
  report::Plot plot;
  plot.title = "Reciprocating friction: a cycle the laws were not fitted to";
  plot.x = {"position", "mm"};
  plot.y = {"friction", "N"};
  const std::vector<identification::FrictionRow> rows = rows_of(judged);
  // One whole cycle, well after the start.
  std::size_t from = 0;
  while (from < rows.size() && rows[from].passage < 4) ++from;
  std::size_t to = from;
  while (to < rows.size() && rows[to].passage < 6) ++to;
  const double middle_mm = 0.5 * (rows[from].along_mm + rows[(from + to) / 2].along_mm);
  report::PlotSeries measured = report::dots("measured");
  for (std::size_t i = from; i < to; i += 3) {
    measured.add(rows[i].along_mm - middle_mm, rows[i].friction_n);
  }
  plot.series.push_back(measured);
  for (const auto& [name, law] : laws) {
    report::PlotSeries series{name};
    const std::vector<double> predicted = law.predict(rows);
    for (std::size_t i = from; i < to; ++i) {
      series.add(rows[i].along_mm - middle_mm, predicted[i]);
    }
    plot.series.push_back(series);
  }
  context.report.add_plot("friction_recording_loop", plot);
}

void study_reciprocating(StudyContext& context, const std::filesystem::path& folder) {
  struct Law {
    const char* name;
    const char* shown;
    double goal;
    std::optional<double> reference;
  };
  const std::array<Law, 4> laws{Law{"dahl", "Dahl", 0.11, 0.11},
                                Law{"dahl_exponent", "Dahl, exponent found", 0.05, 0.048},
                                Law{"maxwell_slip", "Maxwell-slip", 0.05, std::nullopt},
                                Law{"identified", "as identified", 0.05, std::nullopt}};
  const FrictionRecording whole = read_friction_recording(folder / kReciprocating / "first_half.csv");
  double loaded_s = 0.0;
  for (const RecordedFriction& r : whole) {
    if (r.normal_n < 4.9) loaded_s = r.time_s;
  }
  const double end_s = whole.back().time_s;
  const double middle_s = 0.5 * (loaded_s + end_s);
  report::MarkdownTable table({"law", "force", "within %", "across %", "goal %", "parameters (first half)"});
  std::vector<std::pair<std::string, FittedLaw>> shown;
  double delay_s[2] = {0.0, 0.0};
  for (const bool aligned : {false, true}) {
    FrictionRecording halves[2] = {part_of(whole, loaded_s, middle_s), part_of(whole, middle_s, end_s)};
    // Each half's delay from the other one's, when judged across: what is corrected is found on training
    // data.
    if (aligned) {
      for (int h = 0; h < 2; ++h) delay_s[h] = force_delay_s(halves[h]);
    }
    for (const Law& law : laws) {
      Residual within;
      Residual across;
      std::string words;
      for (int h = 0; h < 2; ++h) {
        const FrictionRecording trained = with_force_advanced(halves[h], aligned ? delay_s[h] : 0.0);
        const FrictionRecording other = with_force_advanced(halves[1 - h], aligned ? delay_s[h] : 0.0);
        const FittedLaw fitted = fit_law(law.name, trained);
        within.add(fitted, trained);
        across.add(fitted, other);
        if (h == 0) words = fitted.words;
        if (h == 0 && !aligned) shown.emplace_back(law.shown, fitted);
      }
      const std::string set = aligned ? std::string(kReciprocating) + "_aligned" : kReciprocating;
      const auto reference = aligned ? std::nullopt : law.reference;
      add_residual(context, set, law.name, "within", within.value(), std::nullopt, reference);
      add_residual(context, set, law.name, "across", across.value(), law.goal, reference);
      report::Figure chosen{"friction_recording_residual", {{"set", set}, {"law", law.name}}};
      chosen.value = across.value();
      chosen.goal = law.goal;
      chosen.reference = reference;
      chosen.source = "fitted, and the law chosen, on one half of the recording, judged on the other";
      context.report.add(chosen);
      table.add_row({law.shown, aligned ? "delay removed" : "as recorded", fixed(100.0 * within.value(), 2),
                     fixed(100.0 * across.value(), 2), fixed(100.0 * law.goal, 0), words});
    }
  }
  context.report.add_table(
      "friction_recordings", "Reciprocating friction: what the laws leave", table,
      "Halves of the recording (12 cycles each): fitted to and judged on the same half (within), judged on "
      "the "
      "other (across); every instant counts. An offset of the friction channel is part of each law. Delay "
      "removed: the force bends " +
          fixed(1e3 * delay_s[0], 0) + " and " + fixed(1e3 * delay_s[1], 0) +
          " ms (medians over the starts of each half) after the tip starts to move, and had begun to turn "
          "before: "
          "it was smoothed symmetrically and comes late. There it is read so much later; the delay is that "
          "of "
          "the half fitted to.");
  plot_loop(context, part_of(whole, middle_s, end_s), shown);
}

void study_seal(StudyContext& context, const std::filesystem::path& folder) {
  struct File {
    const char* name;
    std::optional<double> reference_n;
  };
  constexpr double kGoal = 0.05;
  report::MarkdownTable table({"file", "level N", "published N", "error %", "first half N", "second half N",
                               "halves differ %", "residual within %", "across %", "pressure differs bar",
                               "level less pressure N"});
  report::Plot plot;
  plot.title = "Seal friction, O-ring at 1 bar: force less its offset";
  plot.x = {"position", "mm"};
  plot.y = {"friction", "N"};
  for (const File& file : {File{"O-ring_1bar", 5.6}, File{"O-ring_3bar", 7.5}, File{"O-ring_5bar", 9.0},
                           File{"KDN_1bar", std::nullopt}, File{"KDN_3bar", std::nullopt}}) {
    const FrictionRecording whole =
        read_friction_recording(folder / kSeal / (std::string(file.name) + ".csv"));
    const double middle_s = 0.5 * (whole.front().time_s + whole.back().time_s);
    const FrictionRecording halves[2] = {part_of(whole, -1.0, middle_s), part_of(whole, middle_s, 1e9)};
    const auto level = [](const FrictionRecording& part) {
      const auto model = value_of(identify_recording(part, {}));
      return std::pair{parameter(model, "coulomb_force_n"), parameter(model, "coulomb_force_n", true)};
    };
    const auto [level_n, error_n] = level(whole);
    const auto [first_n, first_error_n] = level(halves[0]);
    const auto [second_n, second_error_n] = level(halves[1]);
    const double apart = std::abs(first_n - second_n) / level_n;
    Residual within;
    Residual across;
    for (int h = 0; h < 2; ++h) {
      FrictionRecording trained = halves[h];
      FrictionRecording other = halves[1 - h];
      const FittedLaw fitted = fit_law("dahl", trained);
      for (FrictionRecording* part : {&trained, &other}) {
        for (RecordedFriction& r : *part) r.normal_n = 10.0;  // what the coefficients are reported for
      }
      within.add(fitted, trained);
      across.add(fitted, other);
    }
    const std::string set = std::string(kSeal) + "/" + file.name;
    add_residual(context, set, "dahl", "within", within.value(), std::nullopt, std::nullopt);
    add_residual(context, set, "dahl", "across", across.value(), std::nullopt, std::nullopt);

    report::Figure figure{"recording_coulomb_error",
                          {{"set", kSeal}, {"file", file.name}, {"against", "published level"}}};
    figure.goal = kGoal;
    figure.source = "published: half the difference between directions, 5.6 / 7.5 / 9.0 N";
    if (file.reference_n) {
      figure.value = std::abs(level_n / *file.reference_n - 1.0);
      context.report.add(figure);
    }
    figure.conditions.back().second = "other half";
    figure.source = "difference between the halves of the file over the level";
    figure.value = apart;
    context.report.add(figure);

    // What the supply's own pressure does between the directions is not friction.
    double bar[2] = {0.0, 0.0};
    double count[2] = {0.0, 0.0};
    double force = 0.0, pressure = 0.0;
    const std::vector<identification::FrictionRow> rows = rows_of(whole);
    constexpr std::size_t kLook = 10;
    for (std::size_t i = kLook; i + kLook < rows.size(); ++i) {
      force += whole[i].force_n;
      pressure += whole[i].pressure_bar;
      const double moved_mm = rows[i + kLook].along_mm - rows[i - kLook].along_mm;
      if (std::abs(moved_mm) < 1.0 || rows[i].along_mm < 8.0 || rows[i].along_mm > 28.0) continue;
      const int side = moved_mm > 0.0 ? 0 : 1;
      bar[side] += whole[i].pressure_bar;
      count[side] += 1.0;
    }
    const double apart_bar = bar[0] / count[0] - bar[1] / count[1];
    const double less_n = level_n - 0.5 * apart_bar * force / pressure;
    table.add_row(
        {file.name, with_error(level_n, error_n),
         file.reference_n ? fixed(*file.reference_n, 1) : report::kNoNumber,
         file.reference_n ? fixed(100.0 * std::abs(level_n / *file.reference_n - 1.0), 1) : report::kNoNumber,
         with_error(first_n, first_error_n), with_error(second_n, second_error_n), fixed(100.0 * apart, 1),
         fixed(100.0 * within.value(), 1), fixed(100.0 * across.value(), 1), fixed(apart_bar, 3),
         fixed(less_n, 1)});

    if (std::string(file.name) == "O-ring_1bar") {
      const FittedLaw fitted = fit_law("dahl", halves[0]);
      FrictionRecording other = halves[1];
      for (RecordedFriction& r : other) r.normal_n = 10.0;
      const std::vector<identification::FrictionRow> judged = rows_of(other);
      const std::vector<double> predicted = fitted.predict(judged);
      report::PlotSeries measured = report::dots("measured, second half");
      report::PlotSeries model{"Dahl, fitted to the first half"};
      for (std::size_t i = 0; i < judged.size() && i < 1500; ++i) {
        if (!judged[i].settled) continue;
        measured.add(judged[i].along_mm, judged[i].friction_n - fitted.bias_n);
        model.add(judged[i].along_mm, predicted[i] - fitted.bias_n);
      }
      plot.series = {measured, model};
    }
  }
  context.report.add_table(
      "friction_seals", "Seal friction: Coulomb levels", table,
      "Force = pressure × area + friction: the level is half the difference between the directions, as "
      "published; "
      "the normal force is not known. Pressure differs: between the directions in mid-stroke; the last "
      "column "
      "takes its share (area = mean force over mean pressure) off the level, as what is friction of the seal "
      "alone. Residuals: of Dahl's law, fitted to one half of a file and judged on the same or the other.");
  context.report.add_plot("friction_seal_loop", plot);
}

}  // namespace

void run_identify_friction_recordings(StudyContext& context) {
  const auto folder = recordings_folder();
  if (!folder) {
    report::Report::note("no friction recordings: " + no_recordings_reason());
    report::Figure figure{"recording_residual",
                          {{"set", kReciprocating}, {"law", "dahl"}, {"split", "across"}}};
    figure.failed = no_recordings_reason();
    context.report.add(figure);
    return;
  }
  study_reciprocating(context, *folder);
  study_seal(context, *folder);
}

}  // namespace hapticd::study
