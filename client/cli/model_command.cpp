#include <fmt/core.h>

#include <memory>

#include "client/cli/commands.h"
#include "client/cli/message_json.h"
#include "client/cli/text_table.h"

namespace hapticd::cli {
namespace {

using Align = TextTable::Align;

std::string law_text(bool there, double relative_error) {
  return there ? fmt::format("{:.2g} %", 100.0 * relative_error) : "-";
}

void list(Session& session) {
  const auto answer = session.connect().models();
  if (session.json) return print_json(to_json(answer));
  const Terminal terminal = Terminal::detect();
  TextTable table({"model", "creep", "Hunt-Crossley", "rod", "to mm", "to N", "identified on"},
                  {Align::kLeft, Align::kRight, Align::kRight, Align::kLeft, Align::kRight, Align::kRight});
  for (const auto& model : answer.models()) {
    if (!model.problem().empty()) {
      table.add({model.name(), "", "", "", "", "", terminal.paint(Color::kRed, model.problem())});
      continue;
    }
    table.add({model.name(), law_text(model.creep(), model.creep_relative_error()),
               law_text(model.hunt_crossley(), model.hunt_crossley_relative_error()),
               model.rod_friction() ? "yes" : "-", fmt::format("{:g}", model.max_displacement_mm()),
               fmt::format("{:g}", model.max_force_n()), model.identified_on()});
  }
  table.print(terminal);
}

}  // namespace

void add_model_command(CLI::App& app, Session& session) {
  CLI::App* model = app.add_subcommand("model", "What was identified on real objects");
  model->require_subcommand(1);
  model->footer("Examples:\n  hapticctl model list\n  hapticctl model show foam_ball_3d");
  model->add_subcommand("list", "The models the daemon knows: how well their laws fit, and what they cover")
      ->footer("Example:\n  hapticctl model list --json")
      ->callback([&session] { list(session); });

  const auto name = std::make_shared<std::string>();
  CLI::App* show = model->add_subcommand("show", "A whole model, in the form of a model file");
  show->footer("Example:\n  hapticctl model show foam_ball_3d > my_foam.toml");
  show->add_option("NAME", *name, "One of those that model list shows")->required();
  show->callback([&session, name] {
    const auto answer = session.connect().model(*name);
    if (session.json) return print_json(to_json(answer));
    fmt::print("{}", answer.toml());
  });
}

}  // namespace hapticd::cli
