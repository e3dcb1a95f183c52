#include "client/cli/view/turntable_view.h"

#include <fmt/core.h>

#include "client/cli/text/names.h"
#include "client/cli/text/progress_bar.h"
#include "client/cli/text/text_table.h"
#include "client/cpp/error.h"

namespace hapticd::cli {
namespace {

constexpr int kBarColumns = 32;

std::string position_of(const v1::TurntableStatus& status) {
  return status.has_position_deg() ? fmt::format("{:.2f} deg", status.position_deg())
                                   : std::string("unknown");
}

}  // namespace

std::string turntable_line(const v1::TurntableStatus& status) {
  std::string line = word(status.state());
  for (char& c : line) {
    if (c == '_') c = ' ';
  }
  switch (status.state()) {
    case v1::TURNTABLE_STATE_IDLE:
      return "idle: its port is not open";
    case v1::TURNTABLE_STATE_CONNECTING:
      return "connecting: the drive has reported no position yet";
    case v1::TURNTABLE_STATE_LOST:
      return fmt::format("lost, last seen at {} {:.1f} s ago", position_of(status), status.position_age_s());
    case v1::TURNTABLE_STATE_MOVING:
    case v1::TURNTABLE_STATE_HOMING:
      return fmt::format("{} at {}, {:.1f} deg/s", line, position_of(status), status.velocity_deg_per_s());
    case v1::TURNTABLE_STATE_ALARM:
      return fmt::format("alarm {}: {}", status.alarm_code(), status.alarm_text());
    default:
      break;
  }
  line += " at " + position_of(status);
  if (!status.station().empty()) line += fmt::format(", station '{}'", status.station());
  return line;
}

std::string turntable_progress(const v1::TurntableStatus& status, const Terminal& terminal) {
  const v1::TurntableMotion& motion = status.motion();
  if (!motion.has_target_deg()) {
    return fmt::format("{}  {:.1f} s", turntable_line(status), motion.elapsed_s());
  }
  return fmt::format("{} {}  {} of {:.2f} deg  {:.1f} of {:.1f} s{}",
                     progress_bar(motion.completion(), kBarColumns, terminal),
                     percent_done(motion.completion()), position_of(status), motion.target_deg(),
                     motion.elapsed_s(), motion.expected_s(), motion.stopping() ? "  stopping" : "");
}

std::vector<std::string> turntable_report(const v1::Turntable& table, const Terminal& terminal) {
  TextTable rows;
  rows.add({"turntable", table.name()});
  if (!table.connection().empty()) rows.add({"connection", table.connection()});
  rows.add({"state", turntable_line(table.status())});
  rows.add({"range",
            fmt::format("{:g} … {:g} deg, up to {:g} deg/s and {:g} deg/s²", table.min_deg(), table.max_deg(),
                        table.max_speed_deg_per_s(), table.max_acceleration_deg_per_s2())});
  for (const auto& station : table.stations()) {
    rows.add({"station", fmt::format("{}: {:g} deg{}", station.name(), station.angle_deg(),
                                     station.object().empty() ? "" : ", object " + station.object())});
  }
  const v1::TurntableMotion& motion = table.status().motion();
  if (motion.number() > 0) {
    rows.add(
        {"last motion", fmt::format("{}{}", word(motion.end()),
                                    motion.has_problem() ? ": " + client::one_line(motion.problem()) : "")});
  }
  rows.add({"interlock",
            table.has_interlock() ? client::one_line(table.interlock()) : std::string("it may turn")});
  for (const auto& finding : table.findings()) rows.add({"finding", finding});
  for (const auto& figure : table.figures()) {
    rows.add({figure.name(),
              fmt::format("{:g}{}{}", figure.value(), figure.unit().empty() ? "" : " ", figure.unit())});
  }
  return rows.lines(terminal);
}

}  // namespace hapticd::cli
