
#include <chrono>
#include <memory>

#include "client/cli/commands/commands.h"
#include "client/cli/fleet/on_rigs.h"
#include "client/cli/session/print.h"
#include "client/cli/text/message_json.h"
#include "client/cli/text/names.h"
#include "client/cpp/stop/stop.h"

namespace hapticd::cli {

void add_safety_commands(CLI::App& app, Session& session) {
  const auto reason = std::make_shared<std::string>();
  CLI::App* stop = app.add_subcommand("stop", "Zero force from the next tick until someone clears");
  stop->footer("Examples:\n  hapticctl stop\n  hapticctl stop --reason \"tool change\"");
  stop->add_option("--reason", *reason, "Why, for the daemon's log");
  stop->callback([&session, reason] {
    if (run_on_named_rigs({"stop", "--reason", *reason}, session)) return;
    const client::StopOutcome outcome = client::stop(session.options(), *reason);
    const v1::StopResponse& answer = outcome.answer;
    const char* first = outcome.first == client::StopPath::kStopPort ? "stop_port" : "service";
    const double after_ms = std::chrono::duration<double, std::milli>(outcome.after).count();
    if (session.json) {
      Json document = to_json(answer);
      document["first"] = first;
      document["after_ms"] = after_ms;
      document["both_answered"] = outcome.both_answered;
      document["problem"] = outcome.problem;
      return print_json(document);
    }
    print_line("guard {}: {}; hapticctl clear brings the force back", word(answer.guard_state()),
               word(answer.guard_fault()));
    print_line("first by the {} after {:.1f} ms{}",
               outcome.first == client::StopPath::kStopPort ? "stop port" : "service", after_ms,
               outcome.both_answered ? "; both paths answered" : "");
    if (!outcome.both_answered) {
      print_error_line("hapticctl: the other path did not answer{}{}", outcome.problem.empty() ? "" : ": ",
                       outcome.problem);
    }
    for (const std::string& repair : answer.repairs()) print_line("{}", repair);
  });

  CLI::App* clear = app.add_subcommand("clear", "Leaves a stop or a fault: the force returns over a ramp");
  clear->footer("Example:\n  hapticctl clear");
  clear->callback([&session] {
    const auto answer = session.connect().clear();
    if (session.json) return print_json(to_json(answer));
    const bool was_latched = answer.cleared_fault() > v1::GUARD_FAULT_NONE;
    print_line("{}; guard {} from tick {}",
               was_latched ? "cleared: " + word(answer.cleared_fault()) : "nothing was latched",
               word(answer.guard_state()), answer.effective_tick());
  });
}

}  // namespace hapticd::cli
