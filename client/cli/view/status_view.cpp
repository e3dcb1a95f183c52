#include "client/cli/view/status_view.h"

#include <fmt/core.h>

#include <utility>

#include "client/cli/text/names.h"
#include "client/cli/text/text_table.h"
#include "client/cli/view/lease_view.h"
#include "client/cli/view/live_state.h"
#include "client/cli/view/target_view.h"
#include "client/cli/view/watchdog_view.h"

namespace hapticd::cli {
namespace {

using Align = TextTable::Align;

std::string rig_text(const v1::RigInfo& rig) {
  return fmt::format("{} ({}{}), loop {:g} Hz, hapticd {}", rig.name(), word(rig.kind()),
                     rig.renders_force() ? "" : ", renders no force", rig.loop_rate_hz(),
                     rig.server_version());
}

std::string device_text(const v1::DeviceInfo& device) {
  if (device.model().empty()) return "none";
  const std::string mode = device.structural_mode_hz() > 0.0
                               ? fmt::format("mode {:g} Hz", device.structural_mode_hz())
                               : "mode unknown";
  return fmt::format("{}: {:g} N ({:g} N continuous), resolution {:g} mm, structure {:g} N/mm, {}, {:g} g",
                     device.model(), device.max_force_n(), device.max_continuous_force_n(),
                     device.position_resolution_mm(), device.structural_stiffness_n_per_mm(), mode,
                     device.apparent_mass_g());
}

std::string sensor_text(const v1::SensorInfo& sensor) {
  if (sensor.model().empty()) return "none";
  const std::string tool = sensor.tool_mass_g() > 0 ? fmt::format(", tool {:g} g", sensor.tool_mass_g()) : "";
  return fmt::format("{}: ±{:g} N, resolution {:g} mN, {:g} Hz{}", sensor.model(), sensor.range_n(),
                     1000.0 * sensor.resolution_n(), sensor.sample_rate_hz(), tool);
}

std::string guard_text(const v1::RigState& state, const Terminal& terminal) {
  const std::string text = spaced(word(state.guard_state()));
  switch (state.guard_state()) {
    case v1::GUARD_STATE_LATCHED:
      return terminal.paint(Color::kRed, text) + ": " + spaced(word(state.guard_fault())) +
             "; no force until hapticctl clear";
    case v1::GUARD_STATE_SUSPENDED:
      return terminal.paint(Color::kYellow, text) + ": " + spaced(word(state.guard_fault())) +
             "; the force comes back with its end";
    case v1::GUARD_STATE_RESUMING:
      return terminal.paint(Color::kYellow, text);
    default:
      if (state.scene().empty()) return "no force: no scene is loaded";
      return terminal.paint(Color::kGreen, text);
  }
}

/// The scene computes no target while there is no usable force.
std::string scene_text(const v1::RigState& state) {
  if (state.scene().empty()) return "none (hapticctl scene list)";
  if (state.contact_reason() == v1::CONTACT_REASON_UNSPECIFIED) return state.scene();
  const std::string text =
      fmt::format("{}, target {:g} N/mm", state.scene(), state.target_stiffness_n_per_mm());
  const bool is_linear = state.target_law().kind_case() == v1::TargetLaw::kLinearNPerMm;
  if (!state.has_target_law() || is_linear) return text;
  return text + ": " + target_words(state.target_law());
}

/// The most important fact, then the estimates of the scene.
std::string now_text(const v1::RigState& state) {
  const std::string text = words(live_state(state));
  if (state.contact_reason() == v1::CONTACT_REASON_UNSPECIFIED) return text;
  return fmt::format("{}; reaction {:.3f} N, displacement {:.3f} mm, hand {:.3f} N", text,
                     state.reaction_force_n(), state.displacement_mm(), state.hand_force_n());
}

using Lines = std::vector<std::string>;

/// Appends a text, broken between words where a terminal shows it; further lines are indented by two columns.
void append(Lines& lines, const std::string& text, const Terminal& terminal) {
  constexpr std::size_t kIndent = 2;
  if (!terminal.live) return lines.push_back(text);
  bool first = true;
  for (const std::string& line : wrapped(text, static_cast<std::size_t>(terminal.width) - kIndent)) {
    lines.push_back(first ? line : std::string(kIndent, ' ') + line);
    first = false;
  }
}

void append(Lines& lines, const TextTable& table, const Terminal& terminal, std::size_t indent = 0) {
  for (std::string& line : table.lines(terminal, indent)) lines.push_back(std::move(line));
}

/// Parts with hardware, and their findings; with `detail` their connection and counts.
void append_parts(Lines& lines, const v1::RigState& state, bool detail, const Terminal& terminal) {
  if (state.parts().empty()) return;
  lines.emplace_back();
  for (const v1::PartReport& part : state.parts()) {
    const bool connected = detail && !part.connection().empty();
    append(lines,
           fmt::format("{}  {} {}{}{}", terminal.bold(part.part()), part.driver(), spaced(word(part.state())),
                       connected ? ", " : "", connected ? part.connection() : ""),
           terminal);
    for (const auto& finding : part.findings()) append(lines, "  - " + finding, terminal);
    if (!detail) continue;
    std::string all;
    for (const v1::PartFigure& figure : part.figures()) {
      all += fmt::format("{}{} {:g}{}{}", all.empty() ? "  " : ", ", spaced(figure.name()), figure.value(),
                         figure.unit().empty() ? "" : " ", figure.unit());
    }
    if (!all.empty()) append(lines, all, terminal);
  }
}

/// "1 overrun", "2 overruns".
std::string counted(std::uint64_t count, std::string_view noun) {
  return fmt::format("{} {}{}", count, noun, count == 1 ? "" : "s");
}

void append_loop(Lines& lines, const v1::LoopState& loop, bool detail, const Terminal& terminal) {
  const std::uint64_t overruns =
      loop.overruns_by_wakeup() + loop.overruns_by_compute() + loop.overruns_by_device();
  std::string heading = fmt::format("{}  {}, {}, {} missed; {}", terminal.bold("loop"),
                                    loop.running() ? "running" : "NOT running", counted(loop.ticks(), "tick"),
                                    counted(loop.periods_missed(), "period"), counted(overruns, "overrun"));
  if (detail && overruns > 0) {
    heading += fmt::format(" ({} by wake-up, {} by computation, {} by the device)", loop.overruns_by_wakeup(),
                           loop.overruns_by_compute(), loop.overruns_by_device());
  }
  if (loop.clock_losses() > 0)
    heading += fmt::format("; the device's scheduler was lost {}", counted(loop.clock_losses(), "time"));
  lines.emplace_back();
  append(lines, heading, terminal);
  TextTable table({"µs", "mean", "median", "p99", "p99.9", "max"},
                  {Align::kLeft, Align::kRight, Align::kRight, Align::kRight, Align::kRight, Align::kRight});
  const auto add = [&table](const char* name, const v1::LatencySummary& summary) {
    if (summary.count() == 0) return;
    table.add({name, fmt::format("{:.1f}", summary.mean_us()), fmt::format("{:.1f}", summary.median_us()),
               fmt::format("{:.1f}", summary.p99_us()), fmt::format("{:.1f}", summary.p999_us()),
               fmt::format("{:.1f}", summary.max_us())});
  };
  add("timer late by", loop.timer());
  add("tick late by", loop.wakeup());
  add("period differs by", loop.jitter());
  add("computation", loop.compute());
  add("device", loop.device());
  append(lines, table, terminal, 2);
}

void append_uncertain(Lines& lines, const v1::RigInfo& rig, const Terminal& terminal) {
  if (rig.uncertain_parameters().empty()) return;
  lines.emplace_back();
  lines.push_back(terminal.bold("known only roughly"));
  TextTable table({}, {Align::kLeft, Align::kRight});
  for (const auto& parameter : rig.uncertain_parameters()) {
    table.add(
        {parameter.name(), fmt::format("{:g}", parameter.value()), parameter.unit(), parameter.source()});
  }
  append(lines, table, terminal, 2);
}

/// Options that show more.
std::string more_text(const v1::RigInfo& rig, const StatusDetail& detail) {
  std::string more;
  if (!detail.parts) more += " --parts";
  if (!detail.rough && !rig.uncertain_parameters().empty()) {
    more += fmt::format("{} --rough ({} known only roughly)", more.empty() ? "" : ",",
                        counted(static_cast<std::uint64_t>(rig.uncertain_parameters_size()), "figure"));
  }
  return more.empty() ? more : "more: hapticctl status" + more;
}

}  // namespace

std::vector<std::string> status_lines(const v1::RigInfo& rig, const v1::RigState& state,
                                      const v1::LeaseState& lease, const StatusDetail& detail,
                                      const Terminal& terminal) {
  TextTable facts;
  facts.add({terminal.bold("rig"), rig_text(rig)});
  facts.add({terminal.bold("device"), device_text(rig.device())});
  facts.add({terminal.bold("sensor"), sensor_text(rig.sensor())});
  facts.add({terminal.bold("scene"), scene_text(state)});
  facts.add({terminal.bold("guard"), guard_text(state, terminal)});
  if (lease.has_lease() || !lease.taker().empty()) facts.add({terminal.bold("control"), lease_words(lease)});
  if (!state.watchdog_endpoints().empty())
    facts.add({terminal.bold("watchdog"), watchdog_words(state.watchdog_endpoints())});
  facts.add({terminal.bold("now"), now_text(state)});
  facts.add({terminal.bold("sensor zero"), sensor_zero_words(state)});
  facts.add({terminal.bold("clock"),
             fmt::format("tick {}, {:.3f} s{}", state.tick(), static_cast<double>(state.time_ns()) * 1e-9,
                         state.rig_exhausted() ? " (the recording has ended)" : "")});
  facts.add({terminal.bold("telemetry"),
             fmt::format("{} subscribers, {} records lost{}", state.telemetry_subscribers(),
                         state.telemetry_records_dropped(),
                         state.flight_recorder_on() ? " for all of them" : "; flight recorder off")});
  if (!state.recording().empty()) {
    facts.add(
        {terminal.bold("recording"), fmt::format("{}, {} rows, {} ticks lost", state.recording(),
                                                 state.recording_rows(), state.recording_lost_ticks())});
  }
  if (!state.last_incident().empty())
    facts.add({terminal.bold("last incident"), state.last_incident() + ": " + state.last_incident_cause()});
  Lines lines;
  append(lines, facts, terminal);
  append_parts(lines, state, detail.parts, terminal);
  append_loop(lines, state.loop(), detail.parts, terminal);

  if (!rig.realtime_shortcomings().empty()) {
    lines.emplace_back();
    lines.push_back(terminal.bold("not granted to the loop's thread"));
    TextTable table;
    for (const auto& shortcoming : rig.realtime_shortcomings()) table.add({"-", shortcoming});
    append(lines, table, terminal, 2);
  }
  if (detail.rough) append_uncertain(lines, rig, terminal);
  if (const std::string more = more_text(rig, detail); !more.empty()) {
    lines.emplace_back();
    append(lines, more, terminal);
  }
  return lines;
}

}  // namespace hapticd::cli
