#include <memory>
#include <string>
#include <utility>

#include "client/cli/commands/commands.h"
#include "client/cli/identify/identify_session.h"
#include "client/cli/identify/identify_task.h"
#include "client/cli/plot/svg_file.h"

namespace hapticd::cli {
namespace {

constexpr const char* kEnds =
    "Ctrl-C cancels it and keeps what was gathered; a client that is killed or loses its connection leaves "
    "it\n"
    "running. Exit codes: 0 converged, 5 over without (time, coverage, or cancelled), 1 failed or "
    "refused.\n\n";

/// The command line of one `identify` command.
struct Line {
  IdentifyTask task;
  IdentifyOptions options;
  double timeout_s = 30.0;

  /// Throws LocalError if the plot's name is not that of an SVG.
  IdentifyOptions session_options() const {
    if (!options.svg.empty()) require_svg_path("--svg", options.svg);
    IdentifyOptions result = options;
    result.adopt = task.adopt;
    result.timeout = std::chrono::milliseconds(std::llround(timeout_s * 1000.0));
    return result;
  }
};

void add_watch_options(CLI::App& command, Line& line) {
  command.add_option("--svg", line.options.svg,
                     "At the end, draw fit and coverage to this file: .svg (needs gnuplot)");
  command
      .add_option("--reconnect", line.timeout_s,
                  "Seconds to look for the daemon again where the connection is lost")
      ->check(CLI::Range(0.0, 86400.0))
      ->capture_default_str();
}

/// Adds one kind of identification: its command, with the options all of them have.
CLI::App& add_kind(CLI::App& identify, Session& session, const std::shared_ptr<Line>& line, IdentifyKind kind,
                   const char* name, const char* description, const std::string& footer) {
  CLI::App* command = identify.add_subcommand(name, description);
  command->footer(kEnds + footer);
  command
      ->add_option("--time-limit", line->task.time_limit_s,
                   "Seconds of the rig's time after which it ends with what it has, 1 to 3600; without it 60 "
                   "to 600, by kind")
      ->check(CLI::Range(1.0, 3600.0));
  command->add_flag("--adopt", line->task.adopt,
                    "Once converged, tag the model current, so that scenes use it");
  CLI::Option* detach = command->add_flag("--detach", line->options.detach, "Start it and exit");
  add_watch_options(*command, *line);
  detach->excludes("--svg");
  command->callback([&session, line, kind] {
    const auto request = start_request(kind, line->task);
    const auto description_of_recording = recording_description(line->task);
    IdentifySession(session, line->session_options())
        .start(request, line->task.recording_path, description_of_recording, line->task.reference_path);
  });
  return *command;
}

void add_object_option(CLI::App& command, Line& line) {
  command.add_option("--object", line.task.object, "What is touched: the name its model gets")->required();
}

/// Adds a direction: three numbers, "0,0,-1".
CLI::Option& add_direction(CLI::App& command, const std::string& name, std::vector<double>& direction,
                           const std::string& description) {
  return *command.add_option(name, direction, description)->delimiter(',')->expected(3)->type_name("X,Y,Z");
}

void add_press_direction(CLI::App& command, Line& line) {
  add_direction(command, "--press-direction", line.task.press_direction,
                "Into the object, rig frame (z up); without it 0,0,-1");
}

CLI::Option* add_decimal_comma(CLI::App& command, IdentifyTask& task) {
  return command.add_flag("--decimal-comma", task.decimal_comma,
                          "The CSV file has commas in its numbers, and semicolons or tabs between them");
}

CLI::Option* add_recording_options(CLI::App& command, Line& line) {
  CLI::Option* recording = command.add_option("--recording", line.task.recording_path,
                                              "A CSV file of any size, in the place of the rig");
  command
      .add_option("--column", line.task.columns,
                  "Which column holds what, where the names do not show: quantity=NAME[:unit[:scale]], e.g. "
                  "force=Fz:mN:-1; may be repeated")
      ->needs(recording)
      ->expected(1)
      ->take_all();
  add_decimal_comma(command, line.task)->needs(recording);
  return recording;
}

void add_contact(CLI::App& identify, Session& session) {
  const auto line = std::make_shared<Line>();
  CLI::App& command =
      add_kind(identify, session, line, IdentifyKind::kContact, "contact",
               "The law of an object's deformation, by pressing and tapping on it",
               "Examples:\n  hapticctl identify contact --object sponge --adopt\n"
               "  hapticctl identify contact --object sponge --force 4 --speed 40 --svg sponge.svg\n"
               "  hapticctl identify contact --object silicone --recording cycle.csv --column force=load:mN");
  add_object_option(command, *line);
  command.add_option("--law", line->task.law, "hunt_crossley or creep; without it all that the data allow")
      ->check(CLI::IsMember({"hunt_crossley", "creep"}));
  command
      .add_option("--method", line->task.method,
                  "recursive or batch; without it recursive, refined by batch at the end")
      ->check(CLI::IsMember({"recursive", "batch"}));
  command.add_option("--force", line->task.force_n, "What presses shall reach in N, 0.2 to 30; without it 6")
      ->check(CLI::Range(0.2, 30.0));
  command
      .add_option("--displacement", line->task.displacement_mm,
                  "Depth to be covered in mm; without it by the object's own stiffness")
      ->check(CLI::PositiveNumber);
  command
      .add_option("--speed", line->task.speed_mm_per_s,
                  "Speed to be covered in mm/s; without it by the object's own stiffness")
      ->check(CLI::PositiveNumber);
  add_press_direction(command, *line);
  add_recording_options(command, *line);
}

void add_friction(CLI::App& identify, Session& session) {
  const auto line = std::make_shared<Line>();
  CLI::App& command = add_kind(
      identify, session, line, IdentifyKind::kFriction, "friction",
      "Friction between tip and object: a scan by light taps, then strokes along the same line",
      "Examples:\n  hapticctl identify friction --object sponge --tip rod\n"
      "  hapticctl identify friction --object seal --tip rod --recording strokes.csv --normal-force 5");
  add_object_option(command, *line);
  command.add_option("--tip", line->task.tip, "rod or ball_bearing")
      ->required()
      ->check(CLI::IsMember({"rod", "ball_bearing"}));
  command.add_option("--length", line->task.length_mm, "Of the line in mm, 5 to 200; without it 30")
      ->check(CLI::Range(5.0, 200.0));
  add_press_direction(command, *line);
  add_direction(command, "--line-direction", line->task.line_direction,
                "Along which the tip is tapped and stroked, rig frame; without it 1,0,0");
  CLI::Option* recording = add_recording_options(command, *line);
  command
      .add_option(
          "--normal-force", line->task.normal_force_n,
          "In N, where it was constant and is not in the recording; without either, friction is given in N")
      ->check(CLI::PositiveNumber)
      ->needs(recording);
}

void add_structural(CLI::App& identify, Session& session) {
  const auto line = std::make_shared<Line>();
  CLI::App& command = add_kind(
      identify, session, line, IdentifyKind::kStructuralStiffness, "structural",
      "The device's own stiffness, by presses on virtual walls or on a rigid object",
      "On virtual walls it needs an instrument that measures the tip from outside: on the rig, or in a\n"
      "recording with the columns position_x_mm, device_force_x_N, external_x_mm (and y, z; rig frame), or\n"
      "position_mm, device_force_N, external_mm along the press. Without an instrument, --rigid: the device "
      "presses\n"
      "on an object that hardly yields; the result is then a lower bound. The device renders force.\n\n"
      "Examples:\n  hapticctl identify structural --adopt\n  hapticctl identify structural --constant\n"
      "  hapticctl identify structural --recording walls_with_lvdt.csv --column external=lvdt:um\n"
      "  hapticctl identify structural --rigid --least-object-stiffness 2000");
  command.add_flag("--constant", line->task.constant,
                   "One value for the whole workspace, instead of a field");
  CLI::Option* rigid = command.add_flag(
      "--rigid", line->task.rigid_contact,
      "Without an instrument: pressed on a rigid object; one value, where it is, a lower bound");
  command
      .add_option(
          "--least-object-stiffness", line->task.least_object_stiffness_n_per_mm,
          "How stiff the rigid object is at least, in N/mm, 10 to 1e6; without it 1000. An assumption: "
          "the upper bound and the standard error follow from it")
      ->check(CLI::Range(10.0, 1e6))
      ->needs(rigid);
  CLI::Option* recording = add_recording_options(command, *line);
  add_direction(command, "--press-direction", line->task.press_direction,
                "Recordings: along which the columns of one axis were measured, rig frame (z up); without it "
                "0,0,-1")
      .needs(recording);
}

void add_tool(CLI::App& identify, Session& session) {
  const auto line = std::make_shared<Line>();
  CLI::App& command = add_kind(
      identify, session, line, IdentifyKind::kTool, "tool",
      "Mass and centre of mass of the tool, bias and rotation of the sensor, from free motion",
      "Examples:\n  hapticctl identify tool --adopt\n  hapticctl identify tool --recording swaying.csv");
  add_recording_options(command, *line);
}

void add_threshold(CLI::App& identify, Session& session) {
  const auto line = std::make_shared<Line>();
  CLI::App& command = add_kind(identify, session, line, IdentifyKind::kThreshold, "threshold",
                               "The contact threshold that raises no false alarm in free motion",
                               "Examples:\n  hapticctl identify threshold --duration 30\n"
                               "  hapticctl identify threshold --recording free_motion.csv");
  command.add_option("--duration", line->task.duration_s, "Seconds of free motion, 5 to 600; without it 20")
      ->check(CLI::Range(5.0, 600.0));
  add_recording_options(command, *line);
}

void add_gains(CLI::App& identify, Session& session) {
  const auto line = std::make_shared<Line>();
  CLI::App& command = add_kind(
      identify, session, line, IdentifyKind::kGains, "gains",
      "Gains of the controller, by the gain at which the loop begins to oscillate",
      "The device renders force and will vibrate, within the guard's bounds: hold the tool loosely.\n\n"
      "Example:\n  hapticctl identify gains --target 0.5");
  command
      .add_option("--target", line->task.target_stiffness_n_per_mm,
                  "Stiffness to tune at in N/mm, 0.05 to 20; without it 1")
      ->check(CLI::Range(0.05, 20.0));
}

void add_inclusion(CLI::App& identify, Session& session) {
  const auto line = std::make_shared<Line>();
  CLI::App& command = add_kind(
      identify, session, line, IdentifyKind::kInclusion, "inclusion",
      "A stiff inclusion in an object: where it is and what it adds, by presses spread over the object",
      "The object without the inclusion is known by a recording of presses on it (--reference-recording), by "
      "its\ncontact model (--reference-model), or, without either, by the presses far from the inclusion.\n\n"
      "Examples:\n  hapticctl identify inclusion --object lump\n"
      "  hapticctl identify inclusion --object lump --recording with.csv --reference-recording without.csv\n"
      "  hapticctl identify inclusion --object lump --recording with.csv --reference-model phantom");
  add_object_option(command, *line);
  CLI::Option* recording_of_reference =
      command.add_option("--reference-recording", line->task.reference_path,
                         "A CSV file of presses on the same object without the inclusion");
  command
      .add_option("--reference-model", line->task.reference_model,
                  "In the place of that: a model of the object without the inclusion, NAME or NAME@TAG")
      ->excludes(recording_of_reference);
  command
      .add_option("--known-depth", line->task.known_depth_mm,
                  "Depth of the inclusion's centre in mm, where it is known: presses straight over it are "
                  "enough then, and a reference is required")
      ->check(CLI::Range(2.0, 100.0));
  command
      .add_option("--tip-radius", line->task.tip_radius_mm,
                  "Radius of the ball that presses, in mm, 0 to 20; 0 = a point; without it not known, but "
                  "on a simulated rig: on a round object the depth depends on it")
      ->check(CLI::Range(0.0, 20.0));
  command
      .add_option("--reach", line->task.reach_mm,
                  "How far from the first press the object is pressed, in mm, 10 to 100; without it 24")
      ->check(CLI::Range(10.0, 100.0));
  command
      .add_option("--spacing", line->task.spacing_mm,
                  "Between the places that are pressed, in mm, 3 to 30; without it 8")
      ->check(CLI::Range(3.0, 30.0));
  command
      .add_option("--displacement", line->task.displacement_mm,
                  "How deep the presses go, in mm, 3 to 50; without it 13")
      ->check(CLI::Range(3.0, 50.0));
  command.add_option("--recording", line->task.recording_path,
                     "A CSV file of any size, in the place of the rig");
  command
      .add_option("--column", line->task.columns,
                  "Which column holds what, where the names do not show: quantity=NAME[:unit[:scale]], e.g. "
                  "force_z=Fz:mN; may be repeated, and holds of both recordings")
      ->expected(1)
      ->take_all();
  add_decimal_comma(command, line->task);
}

}  // namespace

void add_identify_command(CLI::App& app, Session& session) {
  CLI::App* identify =
      app.add_subcommand("identify", "From touching an object to a model that scenes can load");
  identify->require_subcommand(1);
  identify->footer(
      "An identification belongs to the daemon: one at a time, and anyone may watch or cancel it.\n\n"
      "Examples:\n  hapticctl identify contact --object sponge --adopt\n"
      "  hapticctl identify watch\n  hapticctl identify list");
  add_contact(*identify, session);
  add_friction(*identify, session);
  add_structural(*identify, session);
  add_tool(*identify, session);
  add_threshold(*identify, session);
  add_gains(*identify, session);
  add_inclusion(*identify, session);

  const auto watched = std::make_shared<std::pair<Line, std::string>>();
  CLI::App* watch = identify->add_subcommand("watch", "Watches one that runs, or says how one ended");
  watch->footer(
      "Ctrl-C leaves it running. Exit codes: 0 converged or left, 5 over without, 1 failed or refused.\n\n"
      "Examples:\n  hapticctl identify watch\n  hapticctl identify watch contact-7 --json");
  watch->add_option("ID", watched->second,
                    "As reported at its start; without it the one that runs, else the last");
  add_watch_options(*watch, watched->first);
  watch->callback([&session, watched] {
    IdentifySession(session, watched->first.session_options()).watch(watched->second);
  });

  const auto cancelled = std::make_shared<std::string>();
  CLI::App* cancel = identify->add_subcommand("cancel", "Ends one; what was gathered is kept");
  cancel->footer("Examples:\n  hapticctl identify cancel\n  hapticctl identify cancel contact-7");
  cancel->add_option("ID", *cancelled, "Without it the one that runs");
  cancel->callback([&session, cancelled] { IdentifySession(session, {}).cancel(*cancelled); });

  CLI::App* list = identify->add_subcommand("list", "The last ones, newest first");
  list->footer("Example:\n  hapticctl identify list --json");
  list->callback([&session] { IdentifySession(session, {}).list(); });
}

}  // namespace hapticd::cli
