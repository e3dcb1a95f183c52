#include "client/cli/demo/demo_command.h"
#include "client/cli/program/program.h"

// hapticctl with no command but `demo`: what a first look needs, without waiting for all the others to be
// built.
int main(int argc, char** argv) {
  using namespace hapticd::cli;
  return run_program(argc, argv, [](CLI::App& app, Session& session) {
    add_global_options(app, session);
    add_demo_command(app, session);
  });
}
