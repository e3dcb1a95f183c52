#pragma once

#include "client/cli/session/print.h"
#include "client/cli/session/session.h"

namespace hapticd::cli {

/// Reports an error (on standard error, or as JSON on standard output) and returns its exit code.
ExitCode report(const client::Error& error, const Session& session);
ExitCode report(const LocalError& error, const Session& session);
/// Reports an error of a command line that cannot be carried out as it was typed.
ExitCode report_usage(const LocalError& error, const Session& session);
/// An error as report() prints it as JSON.
Json to_json(const LocalError& error);

}  // namespace hapticd::cli
