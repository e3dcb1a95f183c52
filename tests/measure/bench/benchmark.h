#pragma once

#include <string>
#include <vector>

namespace hapticd::bench {

/// `hapticd_bench tick`: nanoseconds and instructions per tick of every scene, telemetry record included.
struct TickOptions {
  std::string folder;
  double seconds_per_scene = 2.0;
  double resting_hours = 2.0;  ///< 0 = that part is left out
};
/// Returns the exit status.
int run_tick(const TickOptions& options);

/// Runs `ticks` ticks of a scene, or of it with everything forced on, to warm up and as many again to be
/// counted under callgrind.
int run_tick_child(const std::string& scene, long ticks, bool everything);

/// Subscribers: so many streams, read for so many seconds; what they received goes to `result`.
int run_subscriber_child(const std::string& address, double seconds, const std::string& result, int streams,
                         bool blocks);

/// `hapticd_bench realtime`: the live loop under every load there is, from command to effect, fan-out.
struct RealtimeOptions {
  std::string folder;
  bool quick = false;
  std::vector<std::string> only{};  ///< of realtime_parts(); empty = all
  int rounds = 3;                   ///< how often each load has its turn
  double seconds_per_turn = 5.0;
};
/// "command", "fan_out", "loop".
std::vector<std::string> realtime_parts();
int run_realtime(const RealtimeOptions& options);

/// The server that `realtime` compares commands with, until it is asked to end.
int run_echo_child();

/// `hapticd_bench scenes`: what each scene composes and costs, next to the same with everything forced on.
struct ScenesOptions {
  std::string folder;
  bool quick = false;
};
int run_scenes(const ScenesOptions& options);

/// `hapticd_bench netft`: a force sensor behind an emulated Net F/T box at 7 kHz, read at 1 kHz.
struct NetFtOptions {
  std::string folder;
  double seconds = 20.0;
};
int run_netft(const NetFtOptions& options);

/// The box of `netft`, until it is asked to end.
int run_netft_child();

/// `hapticd_bench decode`: what a client pays for a sample of telemetry, by fields and as blocks.
struct DecodeOptions {
  std::string folder;
  bool quick = false;  ///< less than half of everything
};
int run_decode(const DecodeOptions& options);

/// `hapticd_bench recording`: what recording costs the machine.
struct RecordingOptions {
  std::string folder;
  bool quick = false;             ///< a tenth of everything
  std::vector<std::string> only;  ///< "cost", "service", "install"; empty = all
  std::string packages;           ///< for "install": where they are
};
int run_recording(const RecordingOptions& options);

/// `hapticd_bench console`: the page for people in a headless browser, and what it costs the daemon.
struct ConsoleOptions {
  std::string folder;
  bool quick = false;
  double heap_seconds = 120.0;  ///< how long a page is left open to see whether its memory grows
};
int run_console(const ConsoleOptions& options);

/// `hapticd_bench attack`: how fast a recording is uploaded, and what floods make of the daemon's memory.
struct AttackOptions {
  std::string folder;
  bool quick = false;             ///< a tenth of everything
  std::vector<std::string> only;  ///< of attack_parts(); empty = all
};
std::vector<std::string> attack_parts();
int run_attack(const AttackOptions& options);

/// `hapticd_bench pose`: age and cost of poses, instants of touches over networks, the visual page.
struct PoseOptions {
  std::string folder;
  bool quick = false;             ///< a tenth of everything
  std::vector<std::string> only;  ///< of pose_parts(); empty = all
};
std::vector<std::string> pose_parts();
int run_pose(const PoseOptions& options);

/// The 16 subscribers of its part "cpu".
int run_pose_child(const std::string& address, double seconds);

}  // namespace hapticd::bench
