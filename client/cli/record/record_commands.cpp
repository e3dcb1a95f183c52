
#include <memory>

#include "client/cli/commands/commands.h"
#include "client/cli/record/recording_files.h"
#include "client/cli/record/recording_view.h"
#include "client/cli/session/print.h"
#include "client/cli/text/message_json.h"
#include "client/cli/text/names.h"

namespace hapticd::cli {
namespace {

struct StartOptions {
  std::string name;
  std::string note;
  std::string groups;
  std::uint32_t decimation = 1;
};

void add_start_command(CLI::App& record, Session& session) {
  const auto options = std::make_shared<StartOptions>();
  CLI::App* start =
      record.add_subcommand("start", "Begins a recording in the daemon; it goes on when this ends");
  start->footer(
      "Examples:\n  hapticctl record start press --note \"sponge, day 3\"\n"
      "  hapticctl record start long --groups sample,contact --decimation 10");
  start->add_option("NAME", options->name, "Becomes a part of its id [recording]");
  start->add_option("--note", options->note, "Kept in the file");
  start->add_option("--groups", options->groups, "Field groups, separated by commas [all]: " + group_list());
  start->add_option("--decimation", options->decimation, "Every n-th tick")
      ->check(CLI::Range(1, 10000))
      ->capture_default_str();
  start->callback([&session, options] {
    v1::StartRecordingRequest request;
    request.set_name(options->name);
    request.set_note(options->note);
    if (!options->groups.empty()) {
      for (const auto group : parse_groups(options->groups)) request.add_groups(group);
    }
    request.set_decimation(options->decimation);
    const v1::RecordingFile file = session.connect().start_recording(request);
    if (session.json) return print_json(to_json(file));
    print_line("recording {}; hapticctl record stop ends it", file.id());
    if (!options->name.empty() && !file.id().ends_with("_" + options->name))
      print_error_line("hapticctl: '{}' cannot be a part of a file's name as it is", options->name);
  });
}

}  // namespace

void add_record_commands(CLI::App& app, Session& session) {
  constexpr auto kKind = v1::RECORDING_KIND_RECORDING;
  CLI::App* record =
      app.add_subcommand("record", "Recordings in the daemon: every tick, events, nothing lost");
  record->require_subcommand(1);
  add_start_command(*record, session);

  CLI::App* stop = record->add_subcommand("stop", "Ends the recording that runs");
  stop->footer("Example:\n  hapticctl record stop");
  stop->callback([&session] {
    const v1::RecordingFile file = session.connect().stop_recording();
    if (session.json) return print_json(to_json(file));
    print_line(recording_line(file));
    if (!file.end_reason().starts_with("stopped by"))
      print_line("it had ended before: {}", file.end_reason());
  });

  const auto note = std::make_shared<std::string>();
  CLI::App* annotate =
      record->add_subcommand("annotate", "A note in the recording that runs, at this moment");
  annotate->footer("Example:\n  hapticctl record annotate \"subject pressed too hard\"");
  annotate->add_option("TEXT", *note, "The note")->required();
  annotate->callback([&session, note] {
    session.connect().annotate_recording(*note);
    if (session.json) return print_json({{"annotated", *note}});
    print_line("noted");
  });

  add_list_command(*record, session, kKind, "recording");
  add_get_command(*record, session, kKind, "recording");
  add_export_command(*record, session, kKind, "recording");
  add_delete_command(*record, session, kKind, "recording");
}

}  // namespace hapticd::cli
