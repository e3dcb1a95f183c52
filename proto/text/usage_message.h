#pragma once

#include <CLI/CLI.hpp>
#include <string>
#include <vector>

#include "proto/text/suggestion.h"
#include "proto/text/utf8_text.h"

namespace hapticd::text {

/// Long options of a command and of those above it: "--rate-hz".
inline std::vector<std::string> long_options(const CLI::App& command) {
  std::vector<std::string> names;
  for (const CLI::App* one = &command; one != nullptr; one = one->get_parent()) {
    for (const CLI::Option* option : one->get_options()) {
      for (const std::string& name : option->get_lnames()) names.push_back("--" + name);
    }
  }
  return names;
}

/// Returns what a program without commands prints about a wrong command line, in the form that CLI::App asks for.
/// If an option does not exist, it suggests the one that was probably meant.
inline std::string usage_message(const CLI::App* app, const CLI::Error& error) {
  const std::vector<std::string> unknown = app->remaining();
  if (unknown.empty() || !unknown.front().starts_with('-')) return CLI::FailureMessage::simple(app, error);
  const std::string option = unknown.front().substr(0, unknown.front().find('='));
  return app->get_name() + ": there is no such option (got " + printable(option) + "); " +
         did_you_mean(option, long_options(*app), "see " + app->get_name() + " --help") + "\n";
}

}  // namespace hapticd::text
