#include <fmt/core.h>

#include <memory>

#include "client/cli/commands/commands.h"
#include "client/cli/commands/stored_model_commands.h"
#include "client/cli/session/print.h"
#include "client/cli/text/message_json.h"
#include "client/cli/text/text_table.h"
#include "client/cli/view/stored_model_view.h"

namespace hapticd::cli {
namespace {

using Align = TextTable::Align;

std::string law_text(bool there, double relative_error) {
  return there ? fmt::format("{:.2g} %", 100.0 * relative_error) : "-";
}

/// Text about the sources of a model's parts.
std::string stored_text(const v1::ModelSummary& model) {
  std::string text;
  for (const std::string& hash : model.stored()) text += (text.empty() ? "" : ", ") + short_hash(hash);
  return text.empty() ? "-" : text;
}

void list_models(Session& session) {
  const auto answer = session.connect().models();
  if (session.json) return print_json(to_json(answer));
  const Terminal terminal = Terminal::detect();
  TextTable table({"model", "creep", "Hunt-Crossley", "rod", "to mm", "to N", "stored", "identified on"},
                  {Align::kLeft, Align::kRight, Align::kRight, Align::kLeft, Align::kRight, Align::kRight});
  for (const auto& model : answer.models()) {
    if (!model.problem().empty()) {
      table.add({model.name(), "", "", "", "", "", "", terminal.paint(Color::kRed, model.problem())});
      continue;
    }
    table.add({model.name(), law_text(model.creep(), model.creep_relative_error()),
               law_text(model.hunt_crossley(), model.hunt_crossley_relative_error()),
               model.rod_friction() ? "yes" : "-", fmt::format("{:g}", model.max_displacement_mm()),
               fmt::format("{:g}", model.max_force_n()), stored_text(model), model.identified_on()});
  }
  table.print(terminal);
}

void show(Session& session, const std::string& name) {
  if (looks_like_hash(name) && show_stored_model(session, name)) return;
  const auto answer = session.connect().model(name);
  if (session.json) return print_json(to_json(answer));
  print_text(answer.toml());
}

}  // namespace

void add_model_command(CLI::App& app, Session& session) {
  CLI::App* model = app.add_subcommand("model", "What was identified on real objects and on the rig");
  model->require_subcommand(1);
  model->footer(
      "Examples:\n  hapticctl model list\n  hapticctl model show foam_ball_3d\n"
      "  hapticctl model list --stored --object sponge\n  hapticctl model tag 1a2b3c4d5e6f current");

  const auto stored = std::make_shared<bool>(false);
  const auto filter = std::make_shared<StoredModelFilter>();
  CLI::App* list_command = model->add_subcommand(
      "list", "What scenes get by name, and with --stored every model that was identified, newest first");
  list_command->footer(
      "Examples:\n  hapticctl model list\n  hapticctl model list --stored --kind contact --json");
  CLI::Option* of_store =
      list_command->add_flag("--stored", *stored, "The stored models; the loaded scene's are marked");
  list_command
      ->add_option("--kind", filter->kind,
                   "Only these: contact, friction, structural_stiffness, tool, threshold, gains, inclusion")
      ->needs(of_store)
      ->check(CLI::IsMember(
          {"contact", "friction", "structural_stiffness", "tool", "threshold", "gains", "inclusion"}));
  list_command->add_option("--object", filter->object, "Only those of this object")->needs(of_store);
  list_command->add_option("--tag", filter->tag, "Only those with this tag")->needs(of_store);
  list_command->callback([&session, stored, filter] {
    if (*stored) return list_stored_models(session, *filter);
    list_models(session);
  });

  const auto name = std::make_shared<std::string>();
  CLI::App* show_command =
      model->add_subcommand("show", "What a scene gets by a name, as a model file; or a stored model");
  show_command->footer(
      "Examples:\n  hapticctl model show foam_ball_3d > my_foam.toml\n  hapticctl model show sponge@soft\n"
      "  hapticctl model show 1a2b3c4d5e6f");
  show_command
      ->add_option("NAME_OR_HASH", *name, "One of those that model list shows, or NAME@TAG, or a hash")
      ->required();
  show_command->callback([&session, name] { show(session, *name); });

  add_stored_model_commands(*model, session);
}

}  // namespace hapticd::cli
