#include <cstdlib>
#include <exception>

#include "client/cli/commands/commands.h"

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
    const bool asked_for_help = app.exit(error) == 0;
    return static_cast<int>(asked_for_help ? ExitCode::kOk : ExitCode::kUsage);
  } catch (const hapticd::client::Error& error) {
    return static_cast<int>(report(error, session));
  } catch (const LocalError& error) {
    return static_cast<int>(report(error, session));
  } catch (const std::exception& error) {
    return static_cast<int>(report(LocalError(error.what()), session));
  }
  return static_cast<int>(session.exit_code);
}
