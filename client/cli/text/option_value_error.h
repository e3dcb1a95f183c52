#pragma once

#include <optional>

#include "client/cli/session/session.h"

namespace CLI {
class App;
class ParseError;
}  // namespace CLI

namespace hapticd::cli {

/// Returns what an option or argument of `command`, or of a command above it, accepts, if `error` is about a
/// value that it refuses; nothing for other errors. `words` is the command as it was typed.
std::optional<LocalError> option_value_error(const CLI::App& command, const std::string& words,
                                             const CLI::ParseError& error);

}  // namespace hapticd::cli
