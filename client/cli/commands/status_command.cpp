
#include <memory>

#include "client/cli/commands/commands.h"
#include "client/cli/fleet/on_rigs.h"
#include "client/cli/session/print.h"
#include "client/cli/text/message_json.h"
#include "client/cli/view/status_view.h"

namespace hapticd::cli {

void add_status_command(CLI::App& app, Session& session) {
  CLI::App* command = app.add_subcommand("status", "Rig, loop, guard, scene, and what is touched now");
  const auto detail = std::make_shared<StatusDetail>();
  command->add_flag("--parts", detail->parts,
                    "How parts of the rig are reached, what they and the loop count");
  command->add_flag("--rough", detail->rough, "List the figures of the rig that are known only roughly");
  command->footer(
      "Examples:\n  hapticctl status\n  hapticctl status --parts\n"
      "  hapticctl status --json | jq .state.loop.wakeup.p99_us");
  command->callback([&session, detail] {
    std::vector<std::string> on_rigs{"status"};
    if (detail->parts) on_rigs.emplace_back("--parts");
    if (detail->rough) on_rigs.emplace_back("--rough");
    if (run_on_named_rigs(on_rigs, session)) return;
    client::Client client = session.connect();
    const v1::RigInfo rig = client.rig_info();
    const v1::RigState state =
        client.rig_state(session.json ? client::Histograms::kWith : client::Histograms::kWithout);
    const v1::LeaseState lease = client.lease();
    if (session.json) {
      return print_json({{"rig", to_json(rig)}, {"state", to_json(state)}, {"lease", to_json(lease)}});
    }
    for (const std::string& line : status_lines(rig, state, lease, *detail, Terminal::detect())) {
      print_line(line);
    }
  });
}

}  // namespace hapticd::cli
