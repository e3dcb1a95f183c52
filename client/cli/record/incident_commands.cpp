
#include <algorithm>
#include <filesystem>
#include <fstream>
#include <memory>
#include <vector>

#include "client/cli/commands/commands.h"
#include "client/cli/plot/csv_table.h"
#include "client/cli/plot/svg_file.h"
#include "client/cli/plot/temporary_csv.h"
#include "client/cli/record/download.h"
#include "client/cli/record/incident_figure.h"
#include "client/cli/record/recording_files.h"
#include "client/cli/record/recording_view.h"
#include "client/cli/session/print.h"
#include "client/cli/text/message_json.h"

namespace hapticd::cli {
namespace {

constexpr auto kIncident = v1::RECORDING_KIND_INCIDENT;
constexpr double kShownBeforeS = 1.0;
constexpr double kShownAfterS = 0.1;
/// Decimation of an incident that is shown without the ticks around its cause: they are lost.
constexpr std::uint32_t kDecimationOfAll = 10;

struct ShowOptions {
  std::string id;
  std::string svg;
};

/// The comments of the file that begin with `head`, without it.
std::vector<std::string> comments(const std::string& path, const std::string& head) {
  std::vector<std::string> found;
  std::ifstream file(path);
  const std::string whole = "# " + head;
  for (std::string line; std::getline(file, line);) {
    if (line.starts_with(whole)) found.push_back(line.substr(whole.size()));
  }
  return found;
}

v1::RecordingFile find_incident(client::Client& client, const std::string& asked) {
  const std::string id = file_id(client, asked, kIncident);
  const v1::ListRecordingsResponse list = client.recordings(kIncident);
  for (const v1::RecordingFile& file : list.recordings()) {
    if (file.id() == id) return file;
  }
  throw LocalError("there is no such incident", "ID", id, "", "see hapticctl incident list");
}

/// Fetches the ticks around the cause, or if they are lost, some of all; says what is missing.
std::string fetch(client::Client& client, const v1::RecordingFile& file, const std::string& path) {
  v1::ExportRecordingRequest request;
  request.set_id(file.id());
  request.set_kind(kIncident);
  request.set_format(v1::EXPORT_FORMAT_CSV);
  request.set_from_s(std::max(0.0, file.cause_after_s() - kShownBeforeS));
  request.set_to_s(file.cause_after_s() + kShownAfterS);
  const auto problem = [&]() -> std::string {
    try {
      download(client.export_recording(request), path);
      return {};
    } catch (const client::Error& error) {
      if (error.code() != "INVALID_ARGUMENT") throw;
      return error.what();
    }
  };
  if (problem().empty())
    return file.lost_ticks() == 0 ? "" : fmt::format("{} of its ticks are lost", file.lost_ticks());
  request.clear_from_s();
  request.clear_to_s();
  request.set_decimation(kDecimationOfAll);
  const std::string of_all = problem();
  return of_all.empty() ? "the ticks around the cause are lost" : "its ticks: " + of_all;
}

void show_incident(Session& session, const ShowOptions& options) {
  if (!options.svg.empty()) require_svg_path("--out", options.svg);
  client::Client client = session.connect();
  const v1::RecordingFile file = find_incident(client, options.id);
  const TemporaryCsv csv;
  const std::string missing = fetch(client, file, csv.path());
  const std::vector<std::string> events = comments(csv.path(), "event at ");
  const std::vector<std::string> remedy = comments(csv.path(), "recording.remedy: ");
  const std::vector<std::string> cause_ns = comments(csv.path(), "recording.cause_time_ns: ");
  const bool has_ticks = std::filesystem::exists(csv.path());
  const bool draws = has_ticks && !options.svg.empty();
  if (draws) {
    const double cause_s = cause_ns.empty() ? 0.0 : 1e-9 * std::stod(cause_ns.front());
    write_svg(incident_figure(CsvTable::read(csv.path()), file.id(), file.end_reason(), cause_s),
              options.svg);
  }
  if (session.json) {
    Json document = to_json(file);
    document["remedy"] = remedy.empty() ? "" : remedy.front();
    document["events"] = events;
    document["missing"] = missing;
    if (draws) document["plot"] = options.svg;
    return print_json(document);
  }
  print_line(recording_line(file));
  print_line("when    {}, tick {}, {:.1f} s after its beginning", utc_text(file.started_unix_ns()),
             file.cause_tick(), file.cause_after_s());
  print_line("cause   {}", file.end_reason());
  if (!remedy.empty() && !remedy.front().empty()) print_line("remedy  {}", remedy.front());
  if (!missing.empty()) print_line("missing {}", missing);
  for (const std::string& event : events) print_line("event   {}", event);
  if (draws) {
    print_line("plot    {}", options.svg);
  } else if (has_ticks) {
    print_line("plot    hapticctl incident show {} --out incident.svg", file.id());
  }
}

}  // namespace

void add_incident_commands(CLI::App& app, Session& session) {
  CLI::App* incident =
      app.add_subcommand("incident", "The seconds around each fault, as the flight recorder kept them");
  incident->require_subcommand(1);
  add_list_command(*incident, session, kIncident, "incident");

  const auto options = std::make_shared<ShowOptions>();
  CLI::App* show = incident->add_subcommand("show", "Cause, remedy, events; a plot of the last second");
  show->footer(
      "Examples:\n  hapticctl incident show last\n  hapticctl incident show last --out incident.svg");
  show->add_option("ID", options->id, "As `list` shows it, or `last`")->required();
  show->add_option("-o,--out", options->svg, "Where to draw the last second before it (SVG; needs gnuplot)");
  show->callback([&session, options] { show_incident(session, *options); });

  const auto reason = std::make_shared<std::string>();
  CLI::App* make = incident->add_subcommand("make", "Keeps this moment: 20 s before, 2 s after");
  make->footer("Example:\n  hapticctl incident make \"it felt odd\"");
  make->add_option("REASON", *reason, "Why");
  make->callback([&session, reason] {
    session.connect().make_incident(*reason);
    if (session.json) return print_json({{"requested", *reason}});
    print_line("it is there in some seconds: hapticctl incident list");
  });

  add_get_command(*incident, session, kIncident, "incident");
  add_export_command(*incident, session, kIncident, "incident");
  add_delete_command(*incident, session, kIncident, "incident");
}

}  // namespace hapticd::cli
