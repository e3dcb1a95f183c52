#include <fmt/core.h>
#include <fmt/ranges.h>

#include <chrono>
#include <memory>
#include <vector>

#include "client/cli/commands/commands.h"
#include "client/cli/session/print.h"
#include "client/cli/text/message_json.h"
#include "client/cli/text/names.h"
#include "client/cli/text/text_table.h"

namespace hapticd::cli {
namespace {

using Align = TextTable::Align;

void print_simulation(const v1::SimulationInfo& info) {
  TextTable table;
  table.add({"device", info.device()});
  table.add({"object", fmt::format("{}, {:g} N/mm at 4 N", info.object(), info.object_stiffness_n_per_mm())});
  table.add({"others", fmt::format("{}", fmt::join(info.objects(), ", "))});
  table.print(Terminal::detect());
}

/// Ctrl-C and the end of the daemon end a wait.
constexpr std::chrono::hours kForEver{1000};

/// Throws LocalError for a program that goes on until the next one: no wait for it would end.
void check_ends(const v1::HandProgram& program) {
  const auto refuse = [](const char* option, double number) {
    throw LocalError("the hand never ends such a program", option, fmt::format("{:g}", number),
                     "0 or more with --wait", "leave out --wait");
  };
  if (program.hold_s() < 0.0) refuse("--hold", program.hold_s());
  if (program.repetitions() < 0) refuse("--repetitions", program.repetitions());
}

/// One hand program on the command line: its own options write straight into the message that will be sent.
class ProgramCommand {
 public:
  ProgramCommand(CLI::App& hand, Session& session, v1::HandProgramKind kind, const char* description,
                 const char* examples)
      : program_(std::make_shared<v1::HandProgram>()),
        command_(hand.add_subcommand(word(kind), description)) {
    program_->set_kind(kind);
    option("--tilt", &v1::HandProgram::set_tilt_deg,
           "The tool sways so far about x and y, in degrees (0 to 60)");
    command_->footer(std::string("Examples:\n") + examples);
    command_->callback([&session, program = program_, waits = waits_] {
      client::Client client = session.connect();
      if (*waits) check_ends(*program);
      client.set_hand_program(*program);
      if (*waits) client.wait_for_hand(kForEver);
      if (session.json) return print_json({{"program", to_json(*program)}, {"done", *waits}});
      print_line("the hand {}: {}", *waits ? "is done" : "begins", word(program->kind()));
    });
  }

  /// Adds --wait, for programs that come to an end.
  ProgramCommand& wait() {
    command_->add_flag("--wait", *waits_, "Return when the hand is done and the tool is free");
    return *this;
  }

  ProgramCommand& option(const char* name, void (v1::HandProgram::*set)(double), const char* description) {
    command_->add_option_function<double>(
        name, [program = program_, set](const double& value) { ((*program).*set)(value); }, description);
    return *this;
  }

  ProgramCommand& repetitions() {
    command_->add_option_function<std::int32_t>(
        "--repetitions", [program = program_](const std::int32_t& value) { program->set_repetitions(value); },
        "How often; negative = for ever");
    return *this;
  }

  ProgramCommand& vector(const char* name, v1::Vector3* (v1::HandProgram::*field)(),
                         const char* description) {
    command_
        ->add_option_function<std::vector<double>>(
            name,
            [program = program_, field](const std::vector<double>& xyz) {
              v1::Vector3& vector = *((*program).*field)();
              vector.set_x(xyz[0]);
              vector.set_y(xyz[1]);
              vector.set_z(xyz[2]);
            },
            description)
        ->expected(3);
    return *this;
  }

 private:
  std::shared_ptr<v1::HandProgram> program_;
  std::shared_ptr<bool> waits_ = std::make_shared<bool>(false);
  CLI::App* command_;
};

void add_hand_programs(CLI::App& sim, Session& session) {
  using P = v1::HandProgram;
  CLI::App* hand =
      sim.add_subcommand("hand", "What the simulated hand does; options left out take its defaults");
  hand->require_subcommand(1);
  hand->footer("Examples:\n  hapticctl sim hand press --force 2 --hold 3\n  hapticctl sim hand rest");

  ProgramCommand(*hand, session, v1::HAND_PROGRAM_KIND_REST, "Holds the tool still above the object",
                 "  hapticctl sim hand rest\n  hapticctl sim hand rest --wait")
      .wait();
  ProgramCommand(*hand, session, v1::HAND_PROGRAM_KIND_FOLLOW,
                 "Holds the tool loosely and goes along with the guide", "  hapticctl sim hand follow");
  ProgramCommand(*hand, session, v1::HAND_PROGRAM_KIND_TAP, "Strikes the object repeatedly",
                 "  hapticctl sim hand tap --speed 300 --rate 2 --repetitions 10\n"
                 "  hapticctl sim hand tap --slant 30 --direction 0 1 0")
      .option("--speed", &P::set_speed_mm_per_s, "At the surface, in mm/s (up to 1500)")
      .option("--rate", &P::set_rate_hz, "Taps a second")
      .option("--slant", &P::set_tap_slant_deg, "Path from the vertical, in degrees (0 to 60)")
      .vector("--direction", &P::mutable_stroke_direction, "Direction of a slanted path, rig frame: x y z")
      .repetitions()
      .wait();
  ProgramCommand(*hand, session, v1::HAND_PROGRAM_KIND_PRESS, "Slow approach, press, hold, release",
                 "  hapticctl sim hand press --force 2 --hold 3 --wait\n"
                 "  hapticctl sim hand press --depth 5 --hold -1")
      .option("--force", &P::set_force_n, "Press to this force, in N (0 to 30)")
      .option("--depth", &P::set_depth_mm, "Press to this depth instead, in mm (0 to 50)")
      .option("--force-rate", &P::set_force_rate_n_per_s, "How fast the force builds up, in N/s")
      .option("--approach", &P::set_approach_mm_per_s, "Speed of the approach, in mm/s")
      .option("--hold", &P::set_hold_s, "Seconds at full force; negative = for ever")
      .vector("--place", &P::mutable_place_mm, "Where, next to the usual place, in mm: x y z")
      .option("--knock", &P::set_knock_n, "Disturb it every two seconds with this force, in N (0 to 20)")
      .repetitions()
      .wait();
  ProgramCommand(*hand, session, v1::HAND_PROGRAM_KIND_STROKE, "Presses and moves along the surface and back",
                 "  hapticctl sim hand stroke --force 1.5 --speed 100 --length 40 --direction 0 1 0")
      .option("--force", &P::set_force_n, "Normal force, in N (0 to 30)")
      .option("--speed", &P::set_speed_mm_per_s, "Along the surface, in mm/s (up to 1500)")
      .option("--length", &P::set_stroke_length_mm, "Length of a stroke, in mm; then back")
      .option("--knock", &P::set_knock_n, "Disturb it every two seconds with this force, in N (0 to 20)")
      .vector("--direction", &P::mutable_stroke_direction, "Along the surface, rig frame: x y z")
      .repetitions()
      .wait();
  ProgramCommand(*hand, session, v1::HAND_PROGRAM_KIND_WEIGHT,
                 "A mass on the grip instead of a hand, lowered and left",
                 "  hapticctl sim hand weight --mass 408")
      .option("--mass", &P::set_mass_g, "In g")
      .option("--knock", &P::set_knock_n, "Disturb it every two seconds with this force, in N (0 to 20)");
  ProgramCommand(*hand, session, v1::HAND_PROGRAM_KIND_SHAKE,
                 "Free motion driven by a sinusoidal force of the device",
                 "  hapticctl sim hand shake --force 1 --rate 5 --direction 1 0 0 --tilt 20")
      .option("--force", &P::set_force_n, "Amplitude, in N (0 to 30)")
      .option("--rate", &P::set_rate_hz, "Frequency, in Hz")
      .vector("--direction", &P::mutable_shake_direction, "Of the force, rig frame: x y z");
}

}  // namespace

void add_sim_command(CLI::App& app, Session& session) {
  CLI::App* sim = app.add_subcommand("sim", "The simulated hand and object (on a simulated rig only)");
  sim->require_subcommand(1);

  sim->add_subcommand("info", "The simulated device and object, and the objects there are")
      ->footer("Example:\n  hapticctl sim info")
      ->callback([&session] {
        const auto info = session.connect().simulation();
        if (session.json) return print_json(to_json(info));
        print_simulation(info);
      });

  add_hand_programs(*sim, session);

  const auto name = std::make_shared<std::string>();
  CLI::App* object = sim->add_subcommand("object", "Puts another object under the tool");
  object->footer("Examples:\n  hapticctl sim object sponge_block\n  hapticctl sim object none");
  object->add_option("NAME", *name, "One of those that sim info lists")->required();
  object->callback([&session, name] {
    const auto info = session.connect().set_object(*name);
    if (session.json) return print_json(to_json(info));
    print_simulation(info);
  });
}

}  // namespace hapticd::cli
