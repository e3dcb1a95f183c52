#pragma once

namespace hapticd::report {
class Report;
}

namespace hapticd::bench {

/// How late a stop comes, by its own path and by the service, while each attack goes on over the transport
/// that the stop takes too; and what the attack makes of the daemon's memory. Returns how many daemons ended.
int measure_stops_under_attack(report::Report& report, double scale);

}  // namespace hapticd::bench
