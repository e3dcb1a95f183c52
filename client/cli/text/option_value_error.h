#pragma once

#include <optional>

#include "client/cli/session/session.h"

namespace CLI {
class App;
class ParseError;
}  // namespace CLI

namespace hapticd::cli {

/// Says what an option or argument of `command`, or of a command above it, would accept, where `error` is
/// about a value that it does not. `words` is the command as it was typed. Nothing for any other error.
std::optional<LocalError> option_value_error(const CLI::App& command, const std::string& words,
                                             const CLI::ParseError& error);

}  // namespace hapticd::cli
