#include "client/cli/commands/commands.h"
#include "client/cli/program/program.h"

int main(int argc, char** argv) {
  return hapticd::cli::run_program(argc, argv, hapticd::cli::build_app);
}
