#pragma once

#include <string>
#include <vector>

namespace hapticd::report {
class Report;
}

namespace hapticd::bench {

struct StopsUnderAttack {
  double scale = 1.0;             ///< 1 in full; less makes all smaller
  std::vector<std::string> only;  ///< names of attacks; empty = all
};
std::vector<std::string> names_of_attacks();

/// How late a stop comes by each path and transport, while each attack goes on over the transport that the
/// stop takes too; and what the attack makes of the daemon's memory. Returns how many daemons ended.
int measure_stops_under_attack(report::Report& report, const StopsUnderAttack& options);

}  // namespace hapticd::bench
