#include <fmt/core.h>

#include <memory>

#include "client/cli/commands.h"
#include "client/cli/live_state.h"
#include "client/cli/message_json.h"
#include "client/cli/names.h"
#include "client/cli/text_table.h"

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
  return fmt::format("{}: {:g} N ({:g} N continuous), resolution {:g} mm, structure {:g} N/mm, {:g} g",
                     device.model(), device.max_force_n(), device.max_continuous_force_n(),
                     device.position_resolution_mm(), device.structural_stiffness_n_per_mm(),
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
      return terminal.paint(Color::kGreen, text);
  }
}

/// What to know first; the estimates where the scene has them now.
std::string now_text(const v1::RigState& state) {
  const std::string text = words(live_state(state));
  if (state.contact_reason() == v1::CONTACT_REASON_UNSPECIFIED) return text;
  return fmt::format("{}; reaction {:.3f} N, displacement {:.3f} mm, hand {:.3f} N", text,
                     state.reaction_force_n(), state.displacement_mm(), state.hand_force_n());
}

/// What has hardware behind it, and what speaks against it.
void print_parts(const v1::RigState& state, const Terminal& terminal) {
  for (const v1::PartReport& part : state.parts()) {
    fmt::print("\n{}  {} {}{}{}\n", terminal.bold(part.part()), part.driver(), spaced(word(part.state())),
               part.connection().empty() ? "" : ", ", part.connection());
    for (const auto& finding : part.findings()) fmt::print("  - {}\n", finding);
    std::string figures;
    for (const v1::PartFigure& figure : part.figures()) {
      figures += fmt::format("{}{} {:g}{}{}", figures.empty() ? "  " : ", ", spaced(figure.name()),
                             figure.value(), figure.unit().empty() ? "" : " ", figure.unit());
    }
    if (!figures.empty()) fmt::print("{}\n", figures);
  }
}

void print_loop(const v1::LoopState& loop, const Terminal& terminal) {
  fmt::print("\n{}  {}, {} ticks, {} periods missed", terminal.bold("loop"),
             loop.running() ? "running" : "NOT running", loop.ticks(), loop.periods_missed());
  const std::uint64_t overruns =
      loop.overruns_by_wakeup() + loop.overruns_by_compute() + loop.overruns_by_device();
  fmt::print("; {} overruns", overruns);
  if (overruns > 0) {
    fmt::print(" ({} by wake-up, {} by computation, {} by the device)", loop.overruns_by_wakeup(),
               loop.overruns_by_compute(), loop.overruns_by_device());
  }
  if (loop.clock_losses() > 0) fmt::print("; the device's scheduler was lost {} times", loop.clock_losses());
  fmt::print("\n");
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
  table.print(terminal, 2);
}

/// Figures of the rig that are known only roughly; how many, where they are not asked for.
void print_uncertain(const v1::RigInfo& rig, bool all, const Terminal& terminal) {
  if (rig.uncertain_parameters().empty()) return;
  if (!all) {
    fmt::print("\n{} figures of the rig are known only roughly: hapticctl status --rough\n",
               rig.uncertain_parameters_size());
    return;
  }
  fmt::print("\n{}\n", terminal.bold("known only roughly"));
  TextTable table({}, {Align::kLeft, Align::kRight});
  for (const auto& parameter : rig.uncertain_parameters()) {
    table.add(
        {parameter.name(), fmt::format("{:g}", parameter.value()), parameter.unit(), parameter.source()});
  }
  table.print(terminal, 2);
}

void print_status(const v1::RigInfo& rig, const v1::RigState& state, bool rough) {
  const Terminal terminal = Terminal::detect();
  TextTable facts;
  facts.add({terminal.bold("rig"), rig_text(rig)});
  facts.add({terminal.bold("device"), device_text(rig.device())});
  facts.add({terminal.bold("sensor"), sensor_text(rig.sensor())});
  facts.add({terminal.bold("scene"),
             state.scene().empty()
                 ? "none (hapticctl scene list)"
                 : fmt::format("{}, target {:g} N/mm", state.scene(), state.target_stiffness_n_per_mm())});
  facts.add({terminal.bold("guard"), guard_text(state, terminal)});
  facts.add({terminal.bold("now"), now_text(state)});
  facts.add({terminal.bold("sensor zero"), sensor_zero_words(state)});
  facts.add({terminal.bold("clock"),
             fmt::format("tick {}, {:.3f} s{}", state.tick(), static_cast<double>(state.time_ns()) * 1e-9,
                         state.rig_exhausted() ? " (the recording has ended)" : "")});
  facts.add({terminal.bold("telemetry"),
             fmt::format("{} subscribers, {} records lost for all of them", state.telemetry_subscribers(),
                         state.telemetry_records_dropped())});
  facts.print(terminal);
  print_parts(state, terminal);
  print_loop(state.loop(), terminal);

  if (!rig.realtime_shortcomings().empty()) {
    fmt::print("\n{}\n", terminal.bold("not granted to the loop's thread"));
    TextTable table;
    for (const auto& shortcoming : rig.realtime_shortcomings()) table.add({"-", shortcoming});
    table.print(terminal, 2);
  }
  print_uncertain(rig, rough, terminal);
}

}  // namespace

void add_status_command(CLI::App& app, Session& session) {
  CLI::App* command = app.add_subcommand("status", "Rig, loop, guard, scene and what is known only roughly");
  const auto rough = std::make_shared<bool>(false);
  command->add_flag("--rough", *rough, "List the figures of the rig that are known only roughly");
  command->footer("Examples:\n  hapticctl status\n  hapticctl status --json | jq .state.loop.wakeup.p99_us");
  command->callback([&session, rough] {
    client::Client client = session.connect();
    const v1::RigInfo rig = client.rig_info();
    const v1::RigState state =
        client.rig_state(session.json ? client::Histograms::kWith : client::Histograms::kWithout);
    if (session.json) {
      print_json({{"rig", to_json(rig)}, {"state", to_json(state)}});
    } else {
      print_status(rig, state, *rough);
    }
  });
}

}  // namespace hapticd::cli
