#include "client/cli/program/program.h"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <exception>
#include <string_view>

#include "client/cli/session/print.h"
#include "client/cli/text/report.h"
#include "client/cli/text/usage_error.h"
#include "client/cli/text/utf8_check.h"
#include "proto/text/utf8_text.h"

namespace hapticd::cli {

namespace {

LocalError output_lost() {
  return {"the output could not be written", "standard output", errno == 0 ? "" : std::strerror(errno), "",
          "see whether its disk is full, or its reader has ended"};
}

}  // namespace

void add_global_options(CLI::App& app, Session& session) {
  app.require_subcommand(1);
  app.set_version_flag("--version", "hapticctl " HAPTICD_VERSION, "Print the version and exit");
  // Global options may follow the command as well.
  app.fallthrough();
  app.add_option("-s,--server", session.server,
                 "Where hapticd listens: host:port or unix:/path; beyond this machine with certificates; "
                 "tls:host:port: with certificates on this machine, too, e.g. through a tunnel")
      ->envname("HAPTICD_SERVER")
      ->capture_default_str();
  app.add_option("--timeout", session.timeout_s, "Seconds to wait for an answer")
      ->check(CLI::Range(0.01, 3600.0))
      ->capture_default_str();
  app.add_option("--certificates", session.certificates,
                 "Folder of client.crt, client.key and authority.crt, for daemons of other machines [see "
                 "docs/access.md]")
      ->envname("HAPTICD_CERTIFICATES");
  app.add_flag("--json", session.json, "JSON for programs instead of text for people");
}

int run_program(int argc, char** argv, void (*build)(CLI::App& app, Session& session)) {
  // gRPC's log would break the frames on the terminal; hapticctl reports every failure itself.
  setenv("GRPC_VERBOSITY", "NONE", 0);

  Session session;
  session.server = client::kDefaultAddress;
  // Set by hapticctl lease hold; not an option, for others could read it in the list of processes.
  if (const char* token = std::getenv("HAPTICD_LEASE")) session.lease_token = token;
  for (int i = 0; i < argc; ++i) session.command_line += (i == 0 ? "hapticctl" : std::string(" ") + argv[i]);
  session.command_line = text::repaired_utf8(session.command_line);  // names of files may be anything
  CLI::App app;
  app.name("hapticctl");
  build(app, session);
  require_utf8_options(app);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    if (error.get_exit_code() != 0) {
      session.json = std::find(argv, argv + argc, std::string_view("--json")) != argv + argc;
      return static_cast<int>(report_usage(usage_error(app, error), session));
    }
    app.exit(error);
  } catch (const client::Error& error) {
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

}  // namespace hapticd::cli
