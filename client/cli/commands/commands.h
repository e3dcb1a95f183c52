#pragma once

#include <CLI/CLI.hpp>

#include "client/cli/session/session.h"

namespace hapticd::cli {

// One function for each command, in the file named like it: adds the command with its options, help and
// examples to `app`, and has it run on `session` when the command line names it. Both must outlive the
// parsing.

void add_status_command(CLI::App& app, Session& session);
void add_scene_command(CLI::App& app, Session& session);
void add_model_command(CLI::App& app, Session& session);
void add_identify_command(CLI::App& app, Session& session);
void add_calibrate_commands(CLI::App& app, Session& session);
void add_target_command(CLI::App& app, Session& session);
void add_feasible_command(CLI::App& app, Session& session);
void add_telemetry_watch_command(CLI::App& telemetry, Session& session);
void add_telemetry_record_command(CLI::App& telemetry, Session& session);
void add_sim_command(CLI::App& app, Session& session);
void add_rig_commands(CLI::App& app, Session& session);
void add_turntable_command(CLI::App& app, Session& session);
void add_guide_command(CLI::App& app, Session& session);
void add_presentation_command(CLI::App& app, Session& session);
void add_experiment_command(CLI::App& app, Session& session);
void add_safety_commands(CLI::App& app, Session& session);
void add_access_command(CLI::App& app, Session& session);
void add_console_command(CLI::App& app, Session& session);
void add_lease_commands(CLI::App& app, Session& session);
void add_watchdog_command(CLI::App& app, Session& session);
void add_clock_command(CLI::App& app, Session& session);
void add_pose_command(CLI::App& app, Session& session);
void add_plot_command(CLI::App& app, Session& session);
void add_completion_command(CLI::App& app);
void add_rigs_command(CLI::App& app, Session& session);
void add_record_commands(CLI::App& app, Session& session);
void add_incident_commands(CLI::App& app, Session& session);
void add_log_command(CLI::App& app, Session& session);

/// Builds the global options and all commands.
void build_app(CLI::App& app, Session& session);

/// The options that come with every command that subscribes to telemetry.
struct StreamOptions {
  std::string groups;
  std::uint32_t decimation = 1;
  double seconds = 0.0;  ///< 0 = no end
};
void add_stream_options(CLI::App& command, StreamOptions& options);

/// "no" or "3.2 N" …: the value with its unit, with so many `decimals`.
std::string quantity(double value, int decimals, const char* unit);

}  // namespace hapticd::cli
