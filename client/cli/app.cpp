#include <fmt/core.h>

#include "client/cli/commands/commands.h"
#include "client/cli/demo/demo_command.h"
#include "client/cli/program/program.h"
#include "client/cli/text/names.h"

namespace hapticd::cli {

namespace {

/// Adds footers: a command that only has commands below it would inherit the footer of the whole program, so
/// it gets one that lists them.
void add_footers(CLI::App& app) {
  const std::string whole = app.get_footer();
  for (CLI::App* command : app.get_subcommands([](const CLI::App*) { return true; })) {
    if (command->get_footer() != whole) continue;
    std::string lines = "More, with examples:";
    for (const CLI::App* sub : command->get_subcommands([](const CLI::App*) { return true; })) {
      lines += fmt::format("\n  hapticctl {} {} --help", command->get_name(), sub->get_name());
    }
    command->footer(lines);
  }
}

}  // namespace

void build_app(CLI::App& app, Session& session) {
  app.description("hapticctl - talks to hapticd, which changes how stiff a real object feels");
  app.footer(std::string("Examples:\n"
                         "  hapticctl status\n"
                         "  hapticctl scene load tap_1d\n"
                         "  hapticctl target set 0.3\n"
                         "  hapticctl telemetry watch\n\n") +
             kExitCodeHelp);
  add_global_options(app, session);
  app.add_option(
      "--rigs", session.rigs,
      "Rigs of rigs.toml, e.g. left,right or all, in place of --server: with status, doctor, stop");

  add_status_command(app, session);
  add_scene_command(app, session);
  add_model_command(app, session);
  add_identify_command(app, session);
  add_target_command(app, session);
  add_feasible_command(app, session);
  CLI::App* telemetry = app.add_subcommand("telemetry", "The loop's records, live");
  telemetry->require_subcommand(1);
  add_telemetry_watch_command(*telemetry, session);
  add_telemetry_record_command(*telemetry, session);
  add_record_commands(app, session);
  add_incident_commands(app, session);
  add_log_command(app, session);
  add_sim_command(app, session);
  add_turntable_command(app, session);
  add_guide_command(app, session);
  add_presentation_command(app, session);
  add_experiment_command(app, session);
  add_safety_commands(app, session);
  add_rig_commands(app, session);
  add_access_command(app, session);
  add_console_command(app, session);
  add_lease_commands(app, session);
  add_watchdog_command(app, session);
  add_calibrate_commands(app, session);
  add_clock_command(app, session);
  add_pose_command(app, session);
  add_plot_command(app, session);
  add_demo_command(app, session);
  add_rigs_command(app, session);
  add_completion_command(app);
  add_footers(app);
}

void add_stream_options(CLI::App& command, StreamOptions& options) {
  command.add_option("--groups", options.groups, "Field groups, separated by commas: " + group_list());
  command.add_option("--decimation", options.decimation, "Every n-th tick")
      ->check(CLI::Range(1, 10000))
      ->capture_default_str();
  command
      .add_option("--seconds", options.seconds, "End after so many seconds of the rig's clock; 0 = at Ctrl-C")
      ->check(CLI::NonNegativeNumber)
      ->capture_default_str();
}

std::string quantity(double value, int decimals, const char* unit) {
  return fmt::format("{:.{}f} {}", value, decimals, unit);
}

}  // namespace hapticd::cli
