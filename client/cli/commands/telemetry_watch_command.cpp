
#include <algorithm>
#include <memory>

#include "client/cli/commands/commands.h"
#include "client/cli/plot/recording.h"
#include "client/cli/session/follow.h"
#include "client/cli/session/interrupt.h"
#include "client/cli/session/print.h"
#include "client/cli/text/message_json.h"
#include "client/cli/text/names.h"
#include "client/cli/view/live_screen.h"
#include "client/cli/view/watch_view.h"

namespace hapticd::cli {
namespace {

constexpr std::int64_t kPlainLinePeriodNs = 500'000'000;

struct WatchOptions {
  StreamOptions stream;
  double window_s = 6.0;
};

void watch(const WatchOptions& options, Session& session) {
  client::Client client = session.connect();
  v1::SubscribeRequest request;
  const auto chosen =
      options.stream.groups.empty() ? groups_of(client.rig_info()) : parse_groups(options.stream.groups);
  for (const auto group : chosen) request.add_groups(group);
  request.set_decimation(options.stream.decimation);
  // Small batches: the picture must not be late.
  request.set_batch_size(std::clamp(50U / options.stream.decimation, 1U, 50U));

  client::TelemetryStream stream = client.subscribe(request);
  catch_interrupts();
  WatchView view(options.window_s);
  LiveScreen screen;
  const bool live = Terminal::detect().live && !session.json;
  std::int64_t next_line_ns = 0;
  const auto on_sample = [&](const v1::TelemetrySample& sample) {
    if (session.json) return print_json_line(to_json(sample));
    view.add(sample);
    if (live || sample.time_ns() < next_line_ns) return;
    print_line(view.line());
    std::fflush(stdout);
    next_line_ns = sample.time_ns() + kPlainLinePeriodNs;
  };
  const auto on_idle = [&] {
    if (session.json) std::fflush(stdout);
    if (live && screen.due())
      screen.show(view.frame(stream.account(), Terminal::detect()), Terminal::detect());
  };
  const FollowResult result =
      follow(stream, options.stream.decimation, {.seconds = options.stream.seconds}, on_sample, on_idle);
  if (live) screen.show(view.frame(stream.account(), Terminal::detect()), Terminal::detect());
  screen.keep();
  if (!result.account.complete()) session.exit_code = ExitCode::kGaps;
  if (result.end == StreamEnd::kSilent) {
    print_error_line("hapticctl: the daemon sent nothing for 5 s");
    session.exit_code = ExitCode::kUnreachable;
  }
  if (!session.json) print_line(account_text(result.account));
}

}  // namespace

void add_telemetry_watch_command(CLI::App& telemetry, Session& session) {
  const auto options = std::make_shared<WatchOptions>();
  options->stream.decimation = 10;
  CLI::App* command = telemetry.add_subcommand("watch", "Force over displacement and over time, live");
  command->footer(
      "Ctrl-C ends it. Without a terminal: a plain line every half second; with --json: a line a sample.\n\n"
      "Examples:\n  hapticctl telemetry watch\n"
      "  hapticctl telemetry watch --groups contact,truth --seconds 10 --json");
  add_stream_options(*command, options->stream);
  command->add_option("--window", options->window_s, "Seconds of the past that are shown")
      ->check(CLI::Range(0.5, 60.0))
      ->capture_default_str();
  command->callback([&session, options] { watch(*options, session); });
}

}  // namespace hapticd::cli
