#include <fmt/core.h>
#include <fmt/ranges.h>

#include <filesystem>
#include <memory>

#include "client/cli/commands.h"
#include "client/cli/message_json.h"
#include "client/cli/text_table.h"

namespace hapticd::cli {
namespace {

/// A name goes to the daemon as it is; what looks like a file is read here.
client::SceneSource source_of(const std::string& name_or_file) {
  const bool is_file = name_or_file.find('/') != std::string::npos || name_or_file.ends_with(".toml") ||
                       std::filesystem::is_regular_file(name_or_file);
  if (!is_file) return {client::SceneSource::Kind::kName, name_or_file};
  return {client::SceneSource::Kind::kToml, read_text_file(name_or_file)};
}

template <class List>
std::string listed(const List& items) {
  return items.empty() ? "none" : fmt::format("{}", fmt::join(items, ", "));
}

void print_outline(const v1::SceneOutline& outline) {
  const Terminal terminal = Terminal::detect();
  fmt::print("{}  {}\n", terminal.bold(outline.name()), outline.description());
  TextTable table;
  table.add({"tip", outline.tip()});
  table.add({"object model", outline.object_model()});
  for (int i = 0; i < outline.stages_size(); ++i) table.add({i == 0 ? "stages" : "", outline.stages(i)});
  table.add({"hardware", listed(outline.hardware())});
  table.add({"models", listed(outline.models())});
  table.add({"telemetry", listed(outline.telemetry_groups())});
  table.add(
      {"target", fmt::format("{:g} N/mm at load, at most {:g} N/mm", outline.target_stiffness_n_per_mm(),
                             outline.max_target_stiffness_n_per_mm())});
  table.print(terminal, 2);
}

void list(Session& session) {
  const auto answer = session.connect().scenes();
  if (session.json) return print_json(to_json(answer));
  const Terminal terminal = Terminal::detect();
  TextTable table({"", "scene", "what it is"});
  for (const auto& scene : answer.scenes()) {
    table.add({scene.loaded() ? terminal.paint(Color::kGreen, "*") : " ", scene.name(), scene.description()});
  }
  table.print(terminal);
}

}  // namespace

void add_scene_command(CLI::App& app, Session& session) {
  CLI::App* scene = app.add_subcommand("scene", "What is touched with what, and what it is to feel like");
  scene->require_subcommand(1);
  scene->footer(
      "Examples:\n  hapticctl scene list\n  hapticctl scene load tap_1d\n  hapticctl scene explain my.toml");
  const auto argument = std::make_shared<std::string>();
  const auto add_argument = [argument](CLI::App* command) {
    command->add_option("NAME_OR_FILE", *argument, "A scene the daemon knows, or a scene file (TOML)")
        ->required();
  };

  scene->add_subcommand("list", "The scenes the daemon knows; the loaded one is marked")
      ->footer("Example:\n  hapticctl scene list --json")
      ->callback([&session] { list(session); });

  CLI::App* load = scene->add_subcommand("load", "Loads a scene in the place of the one before");
  load->footer("Examples:\n  hapticctl scene load tap_1d\n  hapticctl scene load ./sponge.toml");
  add_argument(load);
  load->callback([&session, argument] {
    const auto answer = session.connect().load_scene(source_of(*argument));
    if (session.json) return print_json(to_json(answer));
    print_outline(answer.outline());
    fmt::print("renders from tick {}\n", answer.effective_tick());
  });

  scene->add_subcommand("unload", "No scene: zero force")
      ->footer("Example:\n  hapticctl scene unload")
      ->callback([&session] {
        const auto answer = session.connect().unload_scene();
        if (session.json) return print_json(to_json(answer));
        fmt::print("no scene, zero force from tick {}\n", answer.effective_tick());
      });

  CLI::App* explain = scene->add_subcommand("explain", "What a scene is made of, without loading it");
  explain->footer("Example:\n  hapticctl scene explain tap_1d");
  add_argument(explain);
  explain->callback([&session, argument] {
    const auto outline = session.connect().explain_scene(source_of(*argument));
    if (session.json) return print_json(to_json(outline));
    print_outline(outline);
    fmt::print("\n{}\n{}", Terminal::detect().bold("with every default written out"),
               outline.resolved_toml());
    if (!outline.resolved_toml().ends_with('\n')) fmt::print("\n");
  });
}

}  // namespace hapticd::cli
