#include "client/cli/text/usage_error.h"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <string>
#include <vector>

#include "client/cli/text/option_value_error.h"
#include "proto/text/suggestion.h"
#include "proto/text/usage_message.h"

namespace hapticd::cli {
namespace {

/// The command that was typed, as far as it is one: "hapticctl sim hand".
struct Typed {
  const CLI::App* command;
  std::string words;
};

Typed typed_command(const CLI::App& app) {
  Typed typed{&app, app.get_name()};
  while (!typed.command->get_subcommands().empty()) {
    typed.command = typed.command->get_subcommands().front();
    typed.words += " " + typed.command->get_name();
  }
  return typed;
}

std::vector<std::string> commands_below(const CLI::App& command) {
  std::vector<std::string> names;
  for (const CLI::App* one : command.get_subcommands([](const CLI::App*) { return true; }))
    names.push_back(one->get_name());
  return names;
}

}  // namespace

LocalError usage_error(const CLI::App& app, const CLI::ParseError& error) {
  const Typed typed = typed_command(app);
  const std::string help = typed.words + " --help";
  const std::vector<std::string> unknown = app.remaining(true);
  const std::vector<std::string> commands = commands_below(*typed.command);
  // "--" only separates the program that a command runs.
  if (!unknown.empty() && unknown.front().starts_with('-') && unknown.front() != "--") {
    const std::string option = unknown.front().substr(0, unknown.front().find('='));
    return {"there is no such option", typed.words, option, "",
            text::did_you_mean(option, text::long_options(*typed.command), help)};
  }
  if (auto wrong = option_value_error(*typed.command, typed.words, error)) return *wrong;
  if (!commands.empty() && !unknown.empty()) {
    return {"there is no such command", typed.words, unknown.front(), text::comma_separated(commands),
            text::did_you_mean(unknown.front(), commands, help)};
  }
  if (!commands.empty())
    return {"a command is missing", typed.words, "", text::comma_separated(commands), help};
  if (!unknown.empty()) return {"this is one word too many", typed.words, unknown.front(), "", help};
  return {error.what(), typed.words, "", "", help};
}

}  // namespace hapticd::cli
