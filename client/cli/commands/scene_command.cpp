#include <fmt/core.h>
#include <fmt/ranges.h>

#include <filesystem>
#include <memory>

#include "client/cli/commands/commands.h"
#include "client/cli/session/print.h"
#include "client/cli/text/message_json.h"
#include "client/cli/text/text_table.h"
#include "client/cli/text/utf8_check.h"

namespace hapticd::cli {
namespace {

/// Source of a scene: a name goes to the daemon as it is; what looks like a file is read here.
client::SceneSource source_of(const std::string& name_or_file, const std::string& object_model) {
  const bool is_file = name_or_file.find('/') != std::string::npos || name_or_file.ends_with(".toml") ||
                       std::filesystem::is_regular_file(name_or_file);
  client::SceneSource source;
  (is_file ? source.toml : source.name) = is_file ? read_text_file(name_or_file) : name_or_file;
  if (is_file && source.toml.find_first_not_of(" \t\r\n") == std::string::npos)
    throw LocalError("the scene file is empty", name_or_file, "", "",
                     "hapticctl scene show tap_1d prints one to begin with");
  if (is_file) require_utf8(source.toml, name_or_file);
  source.object_model = object_model;
  return source;
}

/// Returns what `call` returns. If the daemon has no scene of that name, but the present folder has a file of
/// it, the refusal suggests the file.
template <class Call>
auto with_hint_at_file(const std::string& name, Call call) {
  try {
    return call();
  } catch (const client::Error& error) {
    const std::string file = "./" + name + ".toml";
    const bool is_unknown = error.code() == "NOT_FOUND" && error.detail().value() == name;
    if (!is_unknown || !std::filesystem::is_regular_file(file)) throw;
    v1::ErrorDetail detail = error.detail();
    detail.set_remedy("did you mean the file '" + file + "'?");
    throw client::Error(error.kind(), error.code(), detail);
  }
}

template <class List>
std::string listed(const List& items) {
  return items.empty() ? "none" : fmt::format("{}", fmt::join(items, ", "));
}

std::string need_text(const v1::ModelNeed& need, const Terminal& terminal) {
  const std::string state =
      need.available() ? terminal.paint(Color::kGreen, "available") : terminal.paint(Color::kRed, "MISSING");
  return fmt::format("{}: {}{}", need.name(), state, need.remark().empty() ? "" : " (" + need.remark() + ")");
}

std::string cost_text(const v1::SceneCost& cost) {
  return fmt::format("{:.0f} ns a tick, 99.9 % below {:.0f} ns; {} ticks {}", cost.median_ns(),
                     cost.p999_ns(), cost.ticks(), cost.remark());
}

/// All that is known of a scene, or what a user has to mind who loads it.
enum class Detail { kAll, kBrief };

void print_outline(const v1::SceneOutline& outline, Detail detail) {
  const Terminal terminal = Terminal::detect();
  print_line("{}  {}", terminal.bold(outline.name()), outline.description());
  TextTable table;
  const bool is_whole = detail == Detail::kAll;
  if (is_whole) table.add({"tip", outline.tip()});
  table.add({"object model", outline.object_model()});
  if (is_whole) {
    for (int i = 0; i < outline.stages_size(); ++i) table.add({i == 0 ? "stages" : "", outline.stages(i)});
    table.add({"hardware", listed(outline.hardware())});
  }
  if (is_whole && outline.model_needs().empty()) table.add({"models", listed(outline.models())});
  for (int i = 0; i < outline.model_needs_size(); ++i) {
    table.add({i == 0 ? "models" : "", need_text(outline.model_needs(i), terminal)});
  }
  for (int i = 0; i < outline.remarks_size(); ++i)
    table.add({i == 0 ? "of the rig" : "", outline.remarks(i)});
  if (is_whole) table.add({"telemetry", listed(outline.telemetry_groups())});
  table.add(
      {"target", fmt::format("{}{:g} N/mm at load, at most {:g} N/mm",
                             outline.target_law().empty() || outline.target_law() == "linear"
                                 ? ""
                                 : outline.target_law() + ", up to ",
                             outline.target_stiffness_n_per_mm(), outline.max_target_stiffness_n_per_mm())});
  if (outline.has_cost()) table.add({"cost", cost_text(outline.cost())});
  if (outline.has_obstacle()) {
    const auto& obstacle = outline.obstacle();
    table.add({terminal.paint(Color::kRed, "cannot load"), obstacle.what()});
    if (!obstacle.limit().empty()) table.add({"", "accepted: " + obstacle.limit()});
    if (!obstacle.remedy().empty()) table.add({"", "remedy: " + obstacle.remedy()});
  }
  table.print(terminal, 2);
}

void list_scenes(Session& session) {
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
  const auto model = std::make_shared<std::string>();
  const auto add_argument = [argument, model](CLI::App* command) {
    command->add_option(
        "--model", *model,
        "Model of the object, in the place of the scene's own: NAME, or NAME@TAG for stored ones");
    command->add_option("NAME_OR_FILE", *argument, "A scene the daemon knows, or a scene file (TOML)")
        ->required();
  };

  scene->add_subcommand("list", "The scenes the daemon knows; the loaded one is marked")
      ->footer("Example:\n  hapticctl scene list --json")
      ->callback([&session] { list_scenes(session); });

  CLI::App* load = scene->add_subcommand("load", "Loads a scene in the place of the one before");
  load->footer(
      "Examples:\n  hapticctl scene load tap_1d\n  hapticctl scene load ./sponge.toml\n"
      "  hapticctl scene load explore_rod --model rubber_ball_3d");
  add_argument(load);
  load->callback([&session, argument, model] {
    const client::SceneSource source = source_of(*argument, *model);
    const auto answer = with_hint_at_file(*argument, [&] { return session.connect().load_scene(source); });
    if (session.json) return print_json(to_json(answer));
    print_outline(answer.outline(), Detail::kBrief);
    print_line("in use from tick {}; its stages: hapticctl scene explain {}", answer.effective_tick(),
               *argument);
  });

  scene->add_subcommand("unload", "No scene: zero force")
      ->footer("Example:\n  hapticctl scene unload")
      ->callback([&session] {
        const auto answer = session.connect().unload_scene();
        if (session.json) return print_json(to_json(answer));
        print_line("no scene, zero force from tick {}", answer.effective_tick());
      });

  CLI::App* show =
      scene->add_subcommand("show", "The text of a scene with every default, to begin one's own");
  show->footer("Example:\n  hapticctl scene show tap_1d > mine.toml");
  add_argument(show);
  show->callback([&session, argument, model] {
    const client::SceneSource source = source_of(*argument, *model);
    const auto outline =
        with_hint_at_file(*argument, [&] { return session.connect().explain_scene(source); });
    if (session.json) return print_json({{"toml", outline.resolved_toml()}});
    print_text(outline.resolved_toml());
  });

  CLI::App* explain =
      scene->add_subcommand("explain", "What a scene is made of and what it costs, without loading it");
  explain->footer(
      "Examples:\n  hapticctl scene explain tap_1d\n"
      "  hapticctl scene explain explore_rod --model sponge_cut");
  add_argument(explain);
  explain->callback([&session, argument, model] {
    const client::SceneSource source = source_of(*argument, *model);
    const auto outline =
        with_hint_at_file(*argument, [&] { return session.connect().explain_scene(source); });
    if (session.json) return print_json(to_json(outline));
    print_outline(outline, Detail::kAll);
    print_line("");
    print_line(Terminal::detect().bold("with every default written out"));
    print_text(outline.resolved_toml());
  });
}

}  // namespace hapticd::cli
