
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <memory>
#include <string>
#include <vector>

#include "client/cli/commands/commands.h"
#include "client/cli/record/recording_view.h"
#include "client/cli/session/interrupt.h"
#include "client/cli/session/print.h"
#include "client/cli/text/message_json.h"
#include "client/cli/text/names.h"

namespace hapticd::cli {
namespace {

struct LogOptions {
  bool follow = false;
  std::uint32_t count = 50;
  std::vector<std::string> kinds;
};

/// Words that --kind takes.
std::vector<std::string> kind_words() {
  std::vector<std::string> words;
  for (int value = v1::RecordingEventKind_MIN + 1; value <= v1::RecordingEventKind_MAX; ++value) {
    words.push_back(word(static_cast<v1::RecordingEventKind>(value)));
  }
  return words;
}

template <class Request>
void set_kinds(const LogOptions& options, Request& request) {
  const std::vector<std::string> words = kind_words();
  for (const std::string& kind : options.kinds) {
    const auto place = std::find(words.begin(), words.end(), kind) - words.begin();
    request.add_kinds(static_cast<v1::RecordingEventKind>(place + 1));
  }
}

void show(const v1::RigEvent& one, const Session& session) {
  if (session.json) return print_json_line(to_json(one));
  const v1::RecordingEvent& event = one.event();
  print_line("{}  {:<14}  {}{}", utc_text(event.unix_ns()), word(event.kind()), event.text(),
             event.by().empty() ? std::string() : "  (" + event.by() + ")");
}

/// Ends by itself only when the daemon ends.
void follow(client::Client& client, const LogOptions& options, std::uint64_t after, const Session& session) {
  catch_interrupts();
  v1::WatchEventsRequest request;
  request.set_after_number(after);
  set_kinds(options, request);
  client::EventStream stream = client.watch_events(request);
  v1::EventBatch batch;
  while (!interrupted()) {
    const auto event = stream.next(batch, std::chrono::milliseconds(100));
    if (event == client::EventStream::Event::kEnded) return;
    if (event != client::EventStream::Event::kMessage) continue;
    for (const v1::RigEvent& one : batch.events()) show(one, session);
    std::fflush(stdout);
  }
}

void show_log(const Session& session, const LogOptions& options) {
  client::Client client = session.connect();
  v1::ListEventsRequest request;
  request.set_max_events(options.count);
  set_kinds(options, request);
  const v1::ListEventsResponse list = client.events(request);
  for (const v1::RigEvent& one : list.events()) show(one, session);
  std::fflush(stdout);
  if (!options.follow) return;
  follow(client, options, list.events().empty() ? 0 : list.events().rbegin()->number(), session);
}

}  // namespace

void add_log_command(CLI::App& app, Session& session) {
  const auto options = std::make_shared<LogOptions>();
  CLI::App* log = app.add_subcommand("log", "What happened on the rig: commands, faults, stops, control");
  log->footer(
      "Examples:\n"
      "  hapticctl log\n"
      "  hapticctl log --follow --kind fault --kind stop");
  log->add_flag("-f,--follow", options->follow, "Then each as it happens, until Ctrl-C");
  log->add_option("-n,--count", options->count, "The newest so many, 1 … 1000")
      ->check(CLI::Range(1, 1000))
      ->capture_default_str();
  log->add_option("--kind", options->kinds, "Only this kind; may be given several times")
      ->check(CLI::IsMember(kind_words()));
  log->callback([&session, options] { show_log(session, *options); });
}

}  // namespace hapticd::cli
