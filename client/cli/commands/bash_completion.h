#pragma once

#include <CLI/CLI.hpp>
#include <string>

namespace hapticd::cli {

/// A bash script that completes the commands and options of `app`, generated from what the app itself
/// declares. Install it with: source <(hapticctl completion bash)
std::string bash_completion(const CLI::App& app);

}  // namespace hapticd::cli
