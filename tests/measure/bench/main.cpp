// hapticd_bench: what hapticd costs on this machine. It reports; it asserts nothing.

#include <CLI/CLI.hpp>
#include <exception>
#include <iostream>
#include <string>

#include "tests/measure/bench/benchmark.h"

namespace {

using namespace hapticd::bench;

/// The command of a benchmark, with what all of them have: `--out`, and `--quick` where its options know it.
template <class Options>
CLI::App* add_benchmark(CLI::App& app, int& status, Options& options, int (*run)(const Options&),
                        const std::string& name, const std::string& shows,
                        const std::string& quick = "a tenth of everything") {
  CLI::App* command = app.add_subcommand(name, shows);
  command->add_option("--out", options.folder, "folder for figures.jsonl, tables and plots; made if need be")
      ->required();
  if constexpr (requires { options.quick; }) command->add_flag("--quick", options.quick, quick);
  command->callback([&status, &options, run] { status = run(options); });
  return command;
}

/// A number that is to lie within limits.
template <class Number>
void add_number(CLI::App* command, const std::string& name, Number& number, const std::string& means,
                Number min, Number max) {
  command->add_option(name, number, means)->check(CLI::Range(min, max))->capture_default_str();
}

/// Hidden: what a benchmark starts.
CLI::App* add_child(CLI::App& app, const std::string& name) {
  return app.add_subcommand(name, "")->group("");
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app{"Measures what hapticd costs on this machine."};
  app.require_subcommand(1);
  app.footer(
      "Examples:\n  hapticd_bench tick --out /tmp/bench\n  hapticd_bench realtime --out /tmp/bench --quick");
  int status = 0;

  TickOptions tick;
  auto* tick_command = add_benchmark(app, status, tick, run_tick, "tick",
                                     "nanoseconds and instructions per tick of every scene");
  add_number(tick_command, "--seconds", tick.seconds_per_scene, "time spent on each scene", 0.05, 600.0);
  add_number(tick_command, "--hours", tick.resting_hours,
             "of the rig's time with the tool at rest; 0 leaves it out", 0.0, 1000.0);
  std::string scene;
  long ticks = 0;
  bool everything = false;
  auto* tick_child = add_child(app, "tick-child");
  tick_child->add_option("--scene", scene)->required();
  tick_child->add_option("--ticks", ticks)->required();
  tick_child->add_flag("--everything", everything);
  tick_child->callback([&] { status = run_tick_child(scene, ticks, everything); });

  NetFtOptions netft;
  auto* netft_command = add_benchmark(app, status, netft, run_netft, "netft",
                                      "a force sensor behind a Net F/T box at 7 kHz, read at 1 kHz");
  add_number(netft_command, "--seconds", netft.seconds, "length of the run", 1.0, 86400.0);
  add_child(app, "netft-child")->callback([&] { status = run_netft_child(); });

  std::string address;
  std::string result;
  double child_seconds = 0.0;
  int streams = 1;
  bool blocks = false;
  auto* subscriber = add_child(app, "subscriber-child");
  subscriber->add_option("--server", address)->required();
  subscriber->add_option("--seconds", child_seconds)->required();
  subscriber->add_option("--result", result)->required();
  subscriber->add_option("--streams", streams);
  subscriber->add_option("--blocks", blocks);
  subscriber->callback(
      [&] { status = run_subscriber_child(address, child_seconds, result, streams, blocks); });

  RealtimeOptions realtime;
  auto* realtime_command =
      add_benchmark(app, status, realtime, run_realtime, "realtime",
                    "the live loop under load next to cyclictest, from command to effect, telemetry fan-out",
                    "seconds instead of minutes, the same figures");
  add_number(realtime_command, "--rounds", realtime.rounds, "how often each load has its turn", 1, 1000);
  add_number(realtime_command, "--seconds", realtime.seconds_per_turn, "of each turn", 1.0, 86400.0);
  realtime_command->add_option("--only", realtime.only, "only these parts")
      ->check(CLI::IsMember(realtime_parts()));
  add_child(app, "echo-child")->callback([&] { status = run_echo_child(); });

  ScenesOptions scenes;
  add_benchmark(app, status, scenes, run_scenes, "scenes",
                "what each scene composes and costs, next to everything forced on",
                "without counting instructions more than needed");
  AttackOptions attack;
  auto* attack_command =
      add_benchmark(app, status, attack, run_attack, "attack",
                    "how late a stop comes while the daemon is attacked, and what attacks do to its memory");
  attack_command->add_option("--only", attack.only, "only these parts")->check(CLI::IsMember(attack_parts()));
  DecodeOptions decode;
  add_benchmark(app, status, decode, run_decode, "decode",
                "what a client pays for a sample of telemetry, by fields and as blocks",
                "less than half of everything");

  RecordingOptions recording;
  auto* recording_command =
      add_benchmark(app, status, recording, run_recording, "recording",
                    "what recording, the flight recorder, exports and metrics cost the machine");
  recording_command->add_option(
      "--packages", recording.packages,
      "folder of packages as deploy/package.sh makes them, for the part \"install\"; as root");
  recording_command->add_option("--only", recording.only, "only these parts")
      ->check(CLI::IsMember({"cost", "service", "install"}));

  PoseOptions pose;
  auto* pose_command =
      add_benchmark(app, status, pose, run_pose, "pose",
                    "age and cost of poses, instants of touches over networks, the visual page");
  pose_command->add_option("--only", pose.only, "only these parts")->check(CLI::IsMember(pose_parts()));
  auto* pose_child = add_child(app, "pose-child");
  pose_child->add_option("--server", address)->required();
  pose_child->add_option("--seconds", child_seconds)->required();
  pose_child->callback([&] { status = run_pose_child(address, child_seconds); });

  ConsoleOptions console;
  auto* console_command =
      add_benchmark(app, status, console, run_console, "console",
                    "the page for people in a headless browser, and what it costs the daemon");
  console_command->add_option("--heap-s", console.heap_seconds,
                              "how long a page is left open to see whether its memory grows, s [120]");

  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error);
  } catch (const std::exception& error) {
    std::cerr << "error: " << error.what() << std::endl;
    return 1;
  }
  return status;
}
