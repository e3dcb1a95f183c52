
#include "client/cli/commands/bash_completion.h"
#include "client/cli/commands/commands.h"
#include "client/cli/session/print.h"

namespace hapticd::cli {

void add_completion_command(CLI::App& app) {
  CLI::App* completion =
      app.add_subcommand("completion", "Prints a script that completes commands in a shell");
  completion->require_subcommand(1);
  completion->footer("Example:\n  source <(hapticctl completion bash)");
  completion->add_subcommand("bash", "For bash")
      ->footer("Example:\n  source <(hapticctl completion bash)")
      ->callback([&app] { print_text(bash_completion(app)); });
}

}  // namespace hapticd::cli
