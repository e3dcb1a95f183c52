#pragma once

#include <string>

namespace CLI {
class App;
}

namespace hapticd::cli {

/// Throws LocalError if a text is not UTF-8, which is all that a daemon takes: names its file, or other
/// source, and the line.
void require_utf8(const std::string& text, const std::string& source);

/// Lets the options and arguments of all commands refuse texts that are not UTF-8. Names of files that are
/// there may be others, and so may the words of a program that is run.
void require_utf8_options(CLI::App& app);

}  // namespace hapticd::cli
