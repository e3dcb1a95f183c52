#include <fmt/core.h>

#include <memory>

#include "client/cli/commands/commands.h"
#include "client/cli/fleet/on_rigs.h"
#include "client/cli/text/message_json.h"
#include "client/cli/text/names.h"

namespace hapticd::cli {

void add_safety_commands(CLI::App& app, Session& session) {
  const auto reason = std::make_shared<std::string>();
  CLI::App* stop = app.add_subcommand("stop", "Zero force from the next tick until someone clears");
  stop->footer("Examples:\n  hapticctl stop\n  hapticctl stop --reason \"tool change\"");
  stop->add_option("--reason", *reason, "Why, for the daemon's log");
  stop->callback([&session, reason] {
    if (run_on_named_rigs({"stop", "--reason", *reason}, session)) return;
    const auto answer = session.connect().stop(*reason);
    if (session.json) return print_json(to_json(answer));
    fmt::print("guard {}: {}; hapticctl clear brings the force back\n", word(answer.guard_state()),
               word(answer.guard_fault()));
    for (const std::string& repair : answer.repairs()) fmt::print("{}\n", repair);
  });

  CLI::App* clear = app.add_subcommand("clear", "Leaves a stop or a fault: the force returns over a ramp");
  clear->footer("Example:\n  hapticctl clear");
  clear->callback([&session] {
    const auto answer = session.connect().clear();
    if (session.json) return print_json(to_json(answer));
    if (answer.cleared_fault() > v1::GUARD_FAULT_NONE) {
      fmt::print("cleared: {}; ", word(answer.cleared_fault()));
    } else {
      fmt::print("nothing was latched; ");
    }
    fmt::print("guard {} from tick {}\n", word(answer.guard_state()), answer.effective_tick());
  });
}

}  // namespace hapticd::cli
