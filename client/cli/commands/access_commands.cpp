

#include "client/cli/commands/commands.h"
#include "client/cli/session/print.h"
#include "client/cli/text/message_json.h"
#include "client/cli/text/names.h"
#include "client/cli/text/text_table.h"

namespace hapticd::cli {

namespace {

void print_access(const v1::Access& access) {
  const Terminal terminal = Terminal::detect();
  print_line("you are {}: {} (by {})",
             access.identity().empty() ? "a certificate without a name" : access.identity(),
             access.role() == v1::ROLE_NONE ? "without a role" : word(access.role()), access.role_source());
  print_line("commands need a lease {}",
             access.lease_rule() == v1::LEASE_RULE_REQUIRED ? "always" : "only while a client holds it");
  print_line("");
  TextTable table;
  table.add({"call", "role", "lease", "you may"});
  for (const v1::AccessRule& rule : access.rules()) {
    const bool may = access.role() >= rule.role();
    table.add({rule.method(), rule.role() == v1::ROLE_NONE ? "any identity" : word(rule.role()),
               rule.needs_lease() ? "yes" : "",
               may ? terminal.paint(Color::kGreen, "yes") : terminal.paint(Color::kRed, "no")});
  }
  table.print(terminal);
}

}  // namespace

void add_access_command(CLI::App& app, Session& session) {
  CLI::App* command = app.add_subcommand("access", "Who you are to the daemon, and what every call needs");
  command->footer("Examples:\n  hapticctl access\n  hapticctl --server lab1:50051 access");
  command->callback([&session] {
    const v1::Access access = session.connect().access();
    if (session.json) return print_json(to_json(access));
    print_access(access);
  });
}

}  // namespace hapticd::cli
