#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <exception>
#include <string_view>

#include "client/cli/commands/commands.h"
#include "client/cli/session/print.h"
#include "client/cli/text/report.h"
#include "client/cli/text/usage_error.h"

namespace {

hapticd::cli::LocalError output_lost() {
  return {"the output could not be written", "standard output", errno == 0 ? "" : std::strerror(errno), "",
          "see whether its disk is full, or its reader has ended"};
}

}  // namespace

int main(int argc, char** argv) {
  using namespace hapticd::cli;
  // gRPC's log would break the frames on the terminal; hapticctl reports every failure itself.
  setenv("GRPC_VERBOSITY", "NONE", 0);

  Session session;
  session.server = hapticd::client::kDefaultAddress;
  // Set by hapticctl lease hold; not an option, for others could read it in the list of processes.
  if (const char* token = std::getenv("HAPTICD_LEASE")) session.lease_token = token;
  for (int i = 0; i < argc; ++i) session.command_line += (i == 0 ? "hapticctl" : std::string(" ") + argv[i]);
  CLI::App app;
  app.name("hapticctl");
  build_app(app, session);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    if (error.get_exit_code() != 0) {
      session.json = std::find(argv, argv + argc, std::string_view("--json")) != argv + argc;
      return static_cast<int>(report_usage(usage_error(app, error), session));
    }
    app.exit(error);
  } catch (const hapticd::client::Error& error) {
    return static_cast<int>(report(error, session));
  } catch (const LocalError& error) {
    return static_cast<int>(report(error, session));
  } catch (const std::exception& error) {
    if (std::ferror(stdout) == 0) return static_cast<int>(report(LocalError(error.what()), session));
  }
  if (all_was_printed()) return static_cast<int>(session.exit_code);
  session.json = false;  // it would be printed although nothing can be
  return static_cast<int>(report(output_lost(), session));
}
