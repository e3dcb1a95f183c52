#include <fmt/core.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <memory>
#include <optional>
#include <string>
#include <thread>

#include "client/cli/commands/commands.h"
#include "client/cli/session/interrupt.h"
#include "client/cli/session/print.h"
#include "client/cli/text/message_json.h"
#include "client/cli/text/text_table.h"
#include "client/cli/view/watchdog_view.h"
#include "client/cpp/watchdog/watchdog_endpoint.h"

namespace hapticd::cli {

namespace {

struct EndpointOptions {
  std::string name;
  bool pressed = false;
  bool released = false;
};

void show_watchdog(Session& session) {
  const v1::Watchdog watchdog = session.connect().watchdog();
  if (session.json) return print_json(to_json(watchdog));
  if (watchdog.endpoints().empty()) {
    print_line("this daemon has no watchdog; see [[watchdog.endpoint]] in docs/configuration.md");
    return;
  }
  using Align = TextTable::Align;
  TextTable table({"endpoint", "state", "timeout, ms", "check-ins", "wrong nonces", "by"},
                  {Align::kLeft, Align::kLeft, Align::kRight, Align::kRight, Align::kRight, Align::kLeft});
  for (const v1::WatchdogEndpoint& one : watchdog.endpoints()) {
    table.add({one.name(), endpoint_words(one), fmt::format("{:g}", one.timeout_ms()),
               fmt::format("{}", one.check_ins()), fmt::format("{}", one.wrong_nonces()),
               one.checked_in_by()});
  }
  for (const std::string& line : table.lines(Terminal::detect())) print_line(line);
}

/// True if the error may pass: the daemon is away for a moment, or has too much to do.
bool may_pass(const client::Error& error) {
  return error.kind() != client::ErrorKind::kRefused || error.code() == "RESOURCE_EXHAUSTED" ||
         error.code() == "UNAVAILABLE" || error.code() == "ABORTED";
}

/// Rests until the time is over, or it is interrupted.
void rest(std::chrono::nanoseconds time) {
  const auto until = std::chrono::steady_clock::now() + time;
  while (!interrupted() && std::chrono::steady_clock::now() < until) {
    const auto left = until - std::chrono::steady_clock::now();
    std::this_thread::sleep_for(std::min<std::chrono::nanoseconds>(left, std::chrono::milliseconds(50)));
  }
}

/// Time until which a sender that has just ended may still be taken for alive. Now, if the endpoint is not
/// known.
std::chrono::steady_clock::time_point others_lapse_by(client::Client& client, const std::string& name) {
  constexpr std::chrono::milliseconds kMargin{200};
  const auto now = std::chrono::steady_clock::now();
  const v1::Watchdog watchdog = client.watchdog();
  for (const v1::WatchdogEndpoint& one : watchdog.endpoints()) {
    if (one.name() == name) return now + std::chrono::milliseconds(std::llround(one.timeout_ms())) + kMargin;
  }
  return now;
}

/// Checks in until it is interrupted. A daemon that is away for a moment is tried again; a refusal is not.
void hold_endpoint(Session& session, const EndpointOptions& options) {
  constexpr std::chrono::milliseconds kAgain{100};
  catch_interrupts();
  client::Client client = session.connect();
  client::WatchdogEndpoint endpoint(client, options.name);
  std::optional<bool> pressed;
  if (options.pressed || options.released) pressed = options.pressed;
  bool alive = false;
  const auto others_lapse = others_lapse_by(client, options.name);
  while (!interrupted()) {
    try {
      endpoint.check_in(pressed);
      if (!alive && !session.json) {
        print_error_line("hapticctl: {} checks in every {} ms", options.name,
                         std::chrono::duration_cast<std::chrono::milliseconds>(endpoint.pause()).count());
      }
      alive = true;
      rest(endpoint.pause());
    } catch (const client::Error& error) {
      if (!alive && error.detail().reason() == v1::ERROR_REASON_BUSY &&
          std::chrono::steady_clock::now() < others_lapse) {
        rest(kAgain);
        continue;
      }
      if (!alive || !may_pass(error)) throw;
      print_error_line("hapticctl: {}", error.what());
      std::this_thread::sleep_for(kAgain);
    }
  }
}

}  // namespace

void add_watchdog_command(CLI::App& app, Session& session) {
  CLI::App* watchdog = app.add_subcommand("watchdog", "Programs without which there is no force");
  watchdog->require_subcommand(1);
  CLI::App* get = watchdog->add_subcommand("get", "All endpoints, and which are missing");
  get->footer("Example:\n  hapticctl watchdog get");
  get->callback([&session] { show_watchdog(session); });

  const auto options = std::make_shared<EndpointOptions>();
  CLI::App* hold = watchdog->add_subcommand("hold", "Checks in as an endpoint until Ctrl-C");
  hold->footer(
      "Examples:\n"
      "  hapticctl watchdog hold experiment\n"
      "  hapticctl watchdog hold pedal --pressed      a pedal that is always pressed, to try things out");
  hold->add_option("NAME", options->name, "As it is configured, [[watchdog.endpoint]]")->required();
  CLI::Option* pressed = hold->add_flag("--pressed", options->pressed, "It is a pedal, and pressed");
  hold->add_flag("--released", options->released, "It is a pedal, and released: cuts the force")
      ->excludes(pressed);
  hold->callback([&session, options] { hold_endpoint(session, *options); });
}

}  // namespace hapticd::cli
