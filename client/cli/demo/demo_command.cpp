#include "client/cli/demo/demo_command.h"

#include <CLI/CLI.hpp>
#include <memory>

#include "client/cli/demo/demo_session.h"

namespace hapticd::cli {

void add_demo_command(CLI::App& app, Session& session) {
  const auto options = std::make_shared<DemoOptions>();
  CLI::App* command =
      app.add_subcommand("demo", "A simulated hand presses an object at several target stiffnesses");
  command->footer(
      "Needs a daemon on a simulated rig, and gnuplot. The error of a target is reported, not judged.\n\n"
      "Examples:\n  hapticctl demo\n"
      "  hapticctl demo --object rubber_ball --targets 0.3,0.7 --force 3 --out /tmp/ball");
  command->add_option("--object", options->object, "What is pressed (hapticctl sim info)")
      ->capture_default_str();
  command->add_option("--scene", options->scene, "The scene that renders")->capture_default_str();
  command
      ->add_option("--targets", options->targets_n_per_mm, "Target stiffnesses in N/mm, separated by commas")
      ->delimiter(',')
      ->capture_default_str();
  command->add_option("--force", options->force_n, "Force of the press, in N")
      ->check(CLI::Range(0.1, 30.0))
      ->capture_default_str();
  command->add_option("--hold", options->hold_s, "Seconds at full force")
      ->check(CLI::Range(0.5, 60.0))
      ->capture_default_str();
  command
      ->add_option("--out", options->folder,
                   "Folder for recording, plot and results; made if it is not there")
      ->capture_default_str();
  command->callback([&session, options] { DemoSession(*options, session).run(); });
}

}  // namespace hapticd::cli
