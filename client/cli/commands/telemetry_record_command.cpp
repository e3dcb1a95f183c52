#include <fmt/core.h>

#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <utility>

#include "client/cli/commands/commands.h"
#include "client/cli/plot/recording.h"
#include "client/cli/session/follow.h"
#include "client/cli/session/interrupt.h"
#include "client/cli/session/print.h"
#include "client/cli/session/replaced_file.h"
#include "client/cli/text/names.h"

namespace hapticd::cli {
namespace {

/// Enough for a disk that stalls: 60 s at 1 kHz.
constexpr std::uint32_t kRecorderQueue = 60000;
/// Silence after which the daemon is asked whether what it replays has ended.
constexpr std::chrono::milliseconds kAskAfter{500};

struct RecordOptions {
  StreamOptions stream;
  std::uint64_t samples = 0;
  std::string path;
};

std::string_view end_word(StreamEnd end) {
  switch (end) {
    case StreamEnd::kLimitReached:
      return "as_long_as_asked";
    case StreamEnd::kInterrupted:
      return "interrupted";
    case StreamEnd::kClosedByDaemon:
      return "closed_by_daemon";
    case StreamEnd::kSilent:
      return "silent";
  }
  return "";
}

Json account_json(const client::StreamAccount& account) {
  return {{"samples", account.samples()},
          {"gaps", account.gaps()},
          {"missing", account.missing()},
          {"out_of_order", account.disordered()},
          {"dropped_by_subscriber", account.dropped_by_subscriber()},
          {"dropped_by_server", account.dropped_by_server()},
          {"complete", account.complete()}};
}

/// What is written is CSV, whatever the name.
void refuse_all_but_csv(const std::string& path) {
  const std::string ending = std::filesystem::path(path).extension().string();
  for (const char* other : {".h5", ".hdf5", ".hdf", ".mcap"}) {
    if (ending != other) continue;
    throw LocalError("telemetry is written as CSV only", "FILE.csv", path, "a name that ends in .csv",
                     "for HDF5 and MCAP: hapticctl record start, then hapticctl record export or record get");
  }
}

void record(const RecordOptions& options, Session& session) {
  refuse_all_but_csv(options.path);
  client::Client client = session.connect();
  const v1::RigInfo rig = client.rig_info();
  const auto groups = options.stream.groups.empty() ? groups_of(rig) : parse_groups(options.stream.groups);
  v1::SubscribeRequest request;
  for (const auto group : groups) request.add_groups(group);
  request.set_decimation(options.stream.decimation);
  request.set_queue_samples(kRecorderQueue);
  client::TelemetryStream stream = client.subscribe(request);
  const bool replaces = is_replaced(options.path);
  Recording recording(options.path, origin_lines(rig, client.rig_state(), options.stream.decimation), groups);

  catch_interrupts();
  const bool live = Terminal::detect().live && !session.json;
  auto next_progress = std::chrono::steady_clock::now();
  const auto on_idle = [&] {
    if (!live || std::chrono::steady_clock::now() < next_progress) return;
    next_progress += std::chrono::milliseconds(250);
    write_frame(fmt::format("\r{} samples ", recording.samples()));
  };
  bool has_ended = false;
  std::uint64_t samples = 0;
  auto ask_at = std::chrono::steady_clock::now() + kAskAfter;
  const auto replay_has_ended = [&] {
    const auto now = std::chrono::steady_clock::now();
    const bool is_silent = recording.samples() == std::exchange(samples, recording.samples());
    if (is_silent && now >= ask_at) has_ended = client.rig_state().rig_exhausted();
    if (!is_silent || now >= ask_at) ask_at = now + kAskAfter;
    return has_ended;
  };
  const FollowResult result = follow(
      stream, options.stream.decimation,
      {.seconds = options.stream.seconds, .samples = options.samples, .enough = replay_has_ended},
      [&recording](const v1::TelemetrySample& sample) { recording.add(sample); }, on_idle);
  recording.finish(result.account);
  if (live) write_frame("\r");

  if (result.account.samples() == 0 || !result.account.complete()) session.exit_code = ExitCode::kGaps;
  if (result.end == StreamEnd::kSilent) session.exit_code = ExitCode::kUnreachable;
  if (session.json) {
    Json document{{"file", options.path},
                  {"replaced", replaces},
                  {"end", has_ended ? "replay_ended" : end_word(result.end)}};
    document.update(account_json(result.account));
    return print_json(document);
  }
  print_line("{}: {}{}", options.path, account_text(result.account), replaced_words(replaces));
  if (has_ended) print_line("the recording that is replayed has ended");
  if (result.end == StreamEnd::kSilent)
    print_error_line("hapticctl: ended early, the daemon sent nothing for 5 s");
  if (result.end == StreamEnd::kClosedByDaemon) print_line("the daemon closed the stream");
}

}  // namespace

void add_telemetry_record_command(CLI::App& telemetry, Session& session) {
  const auto options = std::make_shared<RecordOptions>();
  CLI::App* command = telemetry.add_subcommand("record", "Writes telemetry to a CSV file");
  command->footer(
      "The columns carry their units; the head shows rig and scene, the last line what is missing.\n"
      "An existing file is replaced. Ctrl-C ends the recording; the file is complete.\n\n"
      "Examples:\n  hapticctl telemetry record press.csv --seconds 10\n"
      "  hapticctl telemetry record all.csv --samples 60000 --groups contact,deformation,truth");
  command->add_option("FILE.csv", options->path, "Where to write")->required();
  add_stream_options(*command, options->stream);
  command->add_option("--samples", options->samples, "End after so many samples; 0 = no limit")
      ->capture_default_str();
  command->callback([&session, options] { record(*options, session); });
}

}  // namespace hapticd::cli
