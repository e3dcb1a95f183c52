#pragma once

#include "client/cli/session/session.h"

namespace CLI {
class App;
class ParseError;
}  // namespace CLI

namespace hapticd::cli {

/// What is wrong with a command line that `app` has refused with `error`: the word that is not a command or
/// option, what is accepted in its place, and what was probably meant.
LocalError usage_error(const CLI::App& app, const CLI::ParseError& error);

}  // namespace hapticd::cli
