#pragma once

#include <string>
#include <vector>

namespace hapticd::bench {

/// `hapticd_bench tick`: nanoseconds and instructions per tick of every scene, telemetry record included.
struct TickOptions {
  std::string folder;
  double seconds_per_scene = 2.0;
};
/// Returns the exit status.
int run_tick(const TickOptions& options);

/// Runs `ticks` ticks of a scene and nothing else: what is counted under callgrind.
int run_tick_child(const std::string& scene, long ticks);

/// `hapticd_bench live`: the real daemon on the simulated rig with telemetry subscribers, beside cyclictest.
struct LiveOptions {
  std::string folder;
  double seconds = 60.0;
  std::vector<int> subscribers{0, 8};
};
int run_live(const LiveOptions& options);

/// One subscriber of `live`: reads for so many seconds, then writes what it received to `result`.
int run_live_child(const std::string& address, double seconds, const std::string& result);

/// `hapticd_bench netft`: a force sensor behind an emulated Net F/T box at 7 kHz, read at 1 kHz.
struct NetFtOptions {
  std::string folder;
  double seconds = 20.0;
};
int run_netft(const NetFtOptions& options);

/// The box of `netft`, until it is told to end.
int run_netft_child();

}  // namespace hapticd::bench
