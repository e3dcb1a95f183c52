// hapticd_bench: what hapticd costs on this machine. It reports; it asserts nothing.

#include <CLI/CLI.hpp>
#include <exception>
#include <iostream>
#include <string>

#include "tests/measure/bench/benchmark.h"

int main(int argc, char** argv) {
  using namespace hapticd::bench;
  CLI::App app{"Measures what hapticd costs on this machine."};
  app.require_subcommand(1);
  app.footer(
      "Examples:\n  hapticd_bench tick --out /tmp/bench\n  hapticd_bench live --out /tmp/bench --seconds 60");
  int status = 0;

  TickOptions tick;
  auto* tick_command = app.add_subcommand("tick", "nanoseconds and instructions per tick of every scene");
  tick_command->add_option("--out", tick.folder, "folder for figures.jsonl and the table; made if need be")
      ->required();
  tick_command->add_option("--seconds", tick.seconds_per_scene, "time spent on each scene")
      ->check(CLI::Range(0.05, 600.0))
      ->capture_default_str();
  tick_command
      ->add_option("--hours", tick.resting_hours, "of the rig's time with the tool at rest; 0 leaves it out")
      ->check(CLI::Range(0.0, 1000.0))
      ->capture_default_str();
  tick_command->callback([&] { status = run_tick(tick); });

  std::string scene;
  long ticks = 0;
  auto* tick_child = app.add_subcommand("tick-child", "")->group("");  // hidden: started by `tick`
  tick_child->add_option("--scene", scene)->required();
  tick_child->add_option("--ticks", ticks)->required();
  bool everything = false;
  tick_child->add_flag("--everything", everything);
  tick_child->callback([&] { status = run_tick_child(scene, ticks, everything); });

  NetFtOptions netft;
  auto* netft_command =
      app.add_subcommand("netft", "a force sensor behind a Net F/T box at 7 kHz, read at 1 kHz");
  netft_command->add_option("--out", netft.folder, "folder for figures.jsonl and the table; made if need be")
      ->required();
  netft_command->add_option("--seconds", netft.seconds, "length of the run")
      ->check(CLI::Range(1.0, 86400.0))
      ->capture_default_str();
  netft_command->callback([&] { status = run_netft(netft); });
  auto* netft_child =
      app.add_subcommand("netft-child", "")->group("");  // hidden: the box, started by `netft`
  netft_child->callback([&] { status = run_netft_child(); });

#ifdef HAPTICD_BENCH_LIVE
  LiveOptions live;
  auto* live_command =
      app.add_subcommand("live", "the daemon in real time with telemetry subscribers, next to cyclictest");
  live_command->add_option("--out", live.folder, "folder for figures.jsonl and tables; made if need be")
      ->required();
  live_command->add_option("--seconds", live.seconds, "length of each run")
      ->check(CLI::Range(2.0, 86400.0))
      ->capture_default_str();
  live_command
      ->add_option("--subscribers", live.subscribers, "numbers of telemetry subscribers, one run each")
      ->delimiter(',')
      ->check(CLI::Range(0, 256))
      ->capture_default_str();
  live_command->callback([&] { status = run_live(live); });

  std::string address;
  std::string result;
  double child_seconds = 0.0;
  auto* live_child =
      app.add_subcommand("live-child", "")->group("");  // hidden: a subscriber, started by `live`
  live_child->add_option("--server", address)->required();
  live_child->add_option("--seconds", child_seconds)->required();
  live_child->add_option("--result", result)->required();
  int streams = 1;
  live_child->add_option("--streams", streams);
  bool blocks = false;
  live_child->add_option("--blocks", blocks);
  live_child->callback([&] { status = run_live_child(address, child_seconds, result, streams, blocks); });

  RealtimeOptions realtime;
  auto* realtime_command = app.add_subcommand(
      "realtime", "the live loop under load next to cyclictest, from command to effect, telemetry fan-out");
  realtime_command->add_option("--out", realtime.folder, "folder for figures.jsonl, tables and plots")
      ->required();
  realtime_command->add_flag("--quick", realtime.quick, "seconds instead of minutes, the same figures");
  realtime_command->add_option("--rounds", realtime.rounds, "how often each load has its turn")
      ->check(CLI::Range(1, 1000))
      ->capture_default_str();
  realtime_command->add_option("--seconds", realtime.seconds_per_turn, "of each turn")
      ->check(CLI::Range(1.0, 86400.0))
      ->capture_default_str();
  realtime_command->add_option("--only", realtime.only, "only these parts")
      ->check(CLI::IsMember(realtime_parts()));
  realtime_command->callback([&] { status = run_realtime(realtime); });
  auto* echo_child = app.add_subcommand("echo-child", "")->group("");  // hidden: started by `realtime`
  echo_child->callback([&] { status = run_echo_child(); });

  ScenesOptions scenes;
  auto* scenes_command =
      app.add_subcommand("scenes", "what each scene composes and costs, next to everything forced on");
  scenes_command->add_option("--out", scenes.folder, "folder for figures.jsonl, tables and plots")
      ->required();
  scenes_command->add_flag("--quick", scenes.quick, "without counting instructions more than needed");
  scenes_command->callback([&] { status = run_scenes(scenes); });

  AttackOptions attack;
  auto* attack_command = app.add_subcommand(
      "attack", "how fast a recording is uploaded, and what floods do to the daemon's memory");
  attack_command
      ->add_option("--out", attack.folder, "folder for figures.jsonl and the table; made if need be")
      ->required();
  attack_command->add_flag("--quick", attack.quick, "a tenth of everything");
  attack_command->callback([&] { status = run_attack(attack); });

  AccessOptions access;
  auto* access_command = app.add_subcommand(
      "access", "races for the lease, a stop under load, a holder that freezes, what certificates cost");
  access_command
      ->add_option("--out", access.folder, "folder for figures.jsonl and the table; made if need be")
      ->required();
  access_command->add_flag("--quick", access.quick, "a tenth of everything");
  access_command->callback([&] { status = run_access(access); });

  RecordingOptions recording;
  auto* recording_command = app.add_subcommand(
      "recording",
      "what a kill costs a recording, what recording costs the machine, incidents of all faults");
  recording_command
      ->add_option("--out", recording.folder, "folder for figures.jsonl and the table; made if need be")
      ->required();
  recording_command->add_flag("--quick", recording.quick, "a tenth of everything");
  recording_command->add_option(
      "--packages", recording.packages,
      "folder of packages as deploy/package.sh makes them, for the part \"install\"; as root");
  recording_command->add_option("--only", recording.only, "only these parts")
      ->check(CLI::IsMember({"incidents", "cost", "kills", "service", "install"}));
  recording_command->callback([&] { status = run_recording(recording); });

  PoseOptions pose;
  auto* pose_command =
      app.add_subcommand("pose", "age and cost of poses, instants of touches over networks, the visual page");
  pose_command->add_option("--out", pose.folder, "folder for figures.jsonl and the table; made if need be")
      ->required();
  pose_command->add_flag("--quick", pose.quick, "a tenth of everything");
  pose_command->add_option("--only", pose.only, "only these parts")->check(CLI::IsMember(pose_parts()));
  pose_command->callback([&] { status = run_pose(pose); });
  auto* pose_child = app.add_subcommand("pose-child", "")->group("");  // hidden: started by `pose`
  pose_child->add_option("--server", address)->required();
  pose_child->add_option("--seconds", child_seconds)->required();
  pose_child->callback([&] { status = run_pose_child(address, child_seconds); });
  ConsoleOptions console;
  auto* console_command = app.add_subcommand(
      "console", "the page for people in a headless browser, and what it costs the daemon");
  console_command
      ->add_option("--out", console.folder, "folder for figures.jsonl and the table; made if need be")
      ->required();
  console_command->add_flag("--quick", console.quick, "a tenth of everything");
  console_command->add_option("--heap-s", console.heap_seconds,
                              "how long a page is left open to see whether its memory grows, s [120]");
  console_command->callback([&] { status = run_console(console); });
#endif

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
