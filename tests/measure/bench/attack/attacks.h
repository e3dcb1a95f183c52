#pragma once

#include <atomic>
#include <functional>
#include <string>
#include <vector>

#include "tests/measure/bench/attack/victim.h"

namespace hapticd::bench {

/// How an attack goes on, seen by the one who measures meanwhile.
struct AttackState {
  std::atomic<long> inputs{0};  ///< connections, streams, calls or pieces that were tried
  std::atomic<bool> under_way{false};
  std::atomic<bool> done{false};  ///< set it: the attack ends soon after
};

/// What one client, or a few, can do to a daemon without any right but to connect.
struct Attack {
  const char* name;
  /// Attacks over a transport until `state.done`, by threads that it starts and ends.
  std::function<void(const Victim& victim, const std::string& transport, AttackState& state)> run;
  unsigned long max_descriptors = 8192;  ///< of the daemon
};

/// `scale`: 1 in full; less makes the upload smaller.
std::vector<Attack> attacks(double scale);

}  // namespace hapticd::bench
