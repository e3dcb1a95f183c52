
#include <nlohmann/json.hpp>

#include "client/cli/commands/commands.h"
#include "client/cli/fleet/rigs_file.h"
#include "client/cli/text/text_table.h"

namespace hapticd::cli {

void add_rigs_command(CLI::App& app, Session& session) {
  CLI::App* command = app.add_subcommand("rigs", "The rigs of rigs.toml, which --rigs names");
  command->footer(
      "Examples:\n  hapticctl rigs\n  hapticctl --rigs left,right status\n  hapticctl --rigs all stop\n\n"
      "~/.config/hapticd/rigs.toml has a section for each rig:\n"
      "  [left]\n  server = \"192.168.1.20:50051\"\n  note = \"room 12\"");
  command->callback([&session] {
    if (!session.rigs.empty()) throw no_command_for_rigs();
    const std::string path = rigs_file_path();
    const std::vector<ListedRig> rigs = read_rigs(path);
    if (session.json) {
      Json list = Json::array();
      for (const ListedRig& rig : rigs) {
        list.push_back({{"name", rig.name},
                        {"server", rig.server},
                        {"certificates", rig.certificates},
                        {"note", rig.note}});
      }
      return print_json({{"file", path}, {"rigs", list}});
    }
    TextTable table({"rig", "server", "note"});
    for (const ListedRig& rig : rigs) table.add({rig.name, rig.server, rig.note});
    table.print(Terminal::detect());
  });
}

}  // namespace hapticd::cli
