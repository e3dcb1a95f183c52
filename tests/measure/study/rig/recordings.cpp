#include <array>
#include <map>
#include <string>

#include "tests/measure/study/common/recording_set.h"
#include "tests/measure/study/common/rig_study.h"
#include "tests/measure/study/rig/recording_analysis.h"

namespace hapticd::study {
namespace {

using report::fixed;
using report::kNoNumber;
using report::significant;

constexpr std::array kTargetsNPerMm{0.3, 0.7};

constexpr const char* kContactTime = "recording_contact_time_s";
constexpr const char* kStiffness = "recording_loading_stiffness_n_per_mm";
constexpr const char* kRenderedForce = "recording_rendered_force_n";

/// One record of every figure of a file, all without a value.
void add_failures(report::Report& report, const std::string& file, const std::string& why) {
  report.add({.figure = kContactTime, .conditions = {{"file", file}}, .unit = "s", .failed = why});
  for (const char* kind : {"secant", "local"}) {
    report.add({.figure = kStiffness,
                .conditions = {{"file", file}, {"kind", kind}},
                .unit = "N/mm",
                .failed = why});
  }
  for (const double target : kTargetsNPerMm) {
    report.add({.figure = kRenderedForce,
                .conditions = {{"file", file}, {"target", target}},
                .unit = "N",
                .failed = why});
  }
}

/// The row of a file, and its records.
class FileReport {
 public:
  FileReport(report::Report& report, const RecordingEntry& entry) : report_(report), entry_(entry) {}

  void add_contact_and_stiffness(const RecordingAnalysis& analysis, std::vector<std::string>& cells) {
    const std::string no_contact = analysis.fault.empty() ? "no contact was declared" : analysis.fault;
    report_.add({.figure = kContactTime,
                 .conditions = {{"file", entry_.name}},
                 .value = analysis.contact_time_s,
                 .unit = "s",
                 .failed = analysis.contact_time_s ? "" : no_contact});
    const auto& loading = analysis.loading;
    add_stiffness("secant", loading ? std::optional(loading->secant_stiffness_n_per_mm) : std::nullopt,
                  analysis);
    add_stiffness("local", loading ? std::optional(loading->local_stiffness_n_per_mm) : std::nullopt,
                  analysis);

    cells.push_back(analysis.contact_time_s ? fixed(*analysis.contact_time_s, 3) : kNoNumber);
    cells.push_back(fixed(1e3 * analysis.contact_force_n, 1));
    cells.push_back(std::to_string(analysis.contacts));
    cells.push_back(fixed(analysis.peak_force_n, 3));
    cells.push_back(loading ? fixed(loading->displacement_mm, 2) : kNoNumber);
    cells.push_back(loading ? significant(loading->secant_stiffness_n_per_mm) : kNoNumber);
    cells.push_back(loading ? significant(loading->local_stiffness_n_per_mm) : kNoNumber);
  }

  void add_rendered(const RecordingAnalysis& analysis, double target, std::vector<std::string>& cells) {
    report::Figure figure{.figure = kRenderedForce,
                          .conditions = {{"file", entry_.name}, {"target", target}},
                          .unit = "N",
                          .failed = why_no_loading(analysis)};
    if (analysis.loading) figure.value = analysis.loading->rendered_force_n;
    report_.add(figure);
    cells.push_back(analysis.loading ? fixed(analysis.loading->rendered_force_n, 3) : kNoNumber);
  }

 private:
  static std::string why_no_loading(const RecordingAnalysis& analysis) {
    if (analysis.loading) return {};
    if (!analysis.fault.empty()) return analysis.fault;
    return "1 N is not reached: the peak is " + fixed(analysis.peak_force_n, 3) + " N";
  }

  void add_stiffness(const char* kind, std::optional<double> value, const RecordingAnalysis& analysis) {
    report_.add({.figure = kStiffness,
                 .conditions = {{"file", entry_.name}, {"kind", kind}},
                 .value = value,
                 .unit = "N/mm",
                 .failed = why_no_loading(analysis)});
  }

  report::Report& report_;
  const RecordingEntry& entry_;
};

/// The loading of every unscaled recording, and the targets: what lies between curve and line is rendered.
class LoadingPlot {
 public:
  void add(const RecordingEntry& entry, const RecordingAnalysis& analysis) {
    if (!entry.remark.empty() || analysis.displacement_mm.empty()) return;
    const auto [colour, is_new] = colours_.try_emplace(entry.set, static_cast<int>(colours_.size()));
    plot_.series.push_back({.label = is_new ? entry.set : "",
                            .x = analysis.displacement_mm,
                            .y = analysis.reaction_force_n,
                            .colour = colour->second});
  }
  void draw_into(report::Report& report) {
    for (const double target : kTargetsNPerMm) {
      const double end_mm = 1.6 / target;
      plot_.series.push_back({.label = "target " + fixed(target, 1) + " N/mm",
                              .x = {0.0, end_mm},
                              .y = {0.0, target * end_mm},
                              .colour = static_cast<int>(colours_.size()) + (target > 0.5 ? 1 : 0),
                              .dashed = true});
    }
    report.add_plot("recordings", plot_);
  }

 private:
  report::SvgPlot plot_{
      .title = "Recorded loading and targets: the gap between them is what the device renders",
      .x = {.label = "displacement from the contact point", .unit = "mm", .minimum = 0.0},
      .y = {.label = "reaction force", .unit = "N", .minimum = 0.0, .maximum = 1.8},
      .references = {{.value = kReadOffForceN, .label = "read off at 1 N"}}};
  std::map<std::string, int> colours_;
};

void study_file(StudyContext& context, const RecordingEntry& entry, report::MarkdownTable& table,
                LoadingPlot& plot) {
  std::vector<RecordingAnalysis> analyses;
  for (const double target : kTargetsNPerMm) {
    auto analysis = analyse_recording(entry.config, target);
    if (!analysis) {
      add_failures(context.report, entry.name, analysis.error().text());
      report::Report::note(analysis.error().text());
      return;
    }
    analyses.push_back(std::move(*analysis));
  }
  FileReport file(context.report, entry);
  std::vector<std::string> cells{entry.name};
  file.add_contact_and_stiffness(analyses.front(), cells);
  for (std::size_t i = 0; i < kTargetsNPerMm.size(); ++i)
    file.add_rendered(analyses[i], kTargetsNPerMm[i], cells);
  cells.push_back(entry.remark);
  table.add_row(std::move(cells));
  plot.add(entry, analyses.front());
}

}  // namespace

void run_recordings(StudyContext& context) {
  const auto folder = recordings_folder();
  report::MarkdownTable table({"recording", "contact [s]", "at [mN]", "contacts", "peak [N]",
                               "depth at 1 N [mm]", "secant [N/mm]", "local [N/mm]", "rendered, 0.3 N/mm [N]",
                               "rendered, 0.7 N/mm [N]", "remark"});
  LoadingPlot plot;
  for (const std::string& set : press_sets()) {
    const auto entries = folder ? recordings_of(*folder, set) : std::vector<RecordingEntry>{};
    if (entries.empty()) {
      const std::string why = folder ? "there is no recording in '" + set + "'" : no_recordings_reason();
      add_failures(context.report, set, why);
      report::Report::note(std::string(set).append(": ").append(why));
    }
    for (const RecordingEntry& entry : entries) study_file(context, entry, table, plot);
  }
  if (!folder) return;
  context.report.add_table(
      "recordings", "Recordings through tap_1d", table,
      "Contact is declared at 15 mN. Stiffness is read off while loading, at 1 N: force over displacement "
      "from the\n"
      "contact point (secant) and slope between 0.9 and 1.1 N (local). The rendered force is what would go "
      "to the device\n"
      "at 1 N: negative holds against the hand and makes the object stiffer. A dash: 1 N is not reached.");
  plot.draw_into(context.report);
}

}  // namespace hapticd::study
