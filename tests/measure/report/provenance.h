#pragma once

#include <string>
#include <utility>
#include <vector>

namespace hapticd::report {

/// The commit this program was built from, "+" behind it if files were changed; "unknown" without git.
std::string commit();

/// What a number depends on besides the program's text: commit, compiler and its options, processor, cores,
/// memory, kernel. Nothing that changes from run to run.
std::vector<std::pair<std::string, std::string>> provenance();

}  // namespace hapticd::report
