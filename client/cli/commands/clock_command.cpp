#include <fmt/core.h>

#include <chrono>
#include <memory>
#include <optional>
#include <string>
#include <thread>

#include "client/cli/commands/commands.h"
#include "client/cli/session/interrupt.h"
#include "client/cli/session/print.h"
#include "client/cli/text/message_json.h"
#include "client/cli/text/names.h"
#include "client/cli/text/text_table.h"
#include "client/cpp/clock/clock_sync.h"

namespace hapticd::cli {

namespace {

struct ClockOptions {
  double seconds = 2.0;
  double max_drift_ppm = client::ClockEstimator::kDefaultMaxDriftPpm;
};

/// What was found out.
struct ClockFindings {
  client::ClockBounds bounds;
  client::ClockDrift drift;
  std::uint64_t exchanges = 0;
  std::optional<client::RigTime> rig;  ///< now; nothing if it is not known
  std::int64_t now_ns = 0;
  v1::ClockState daemon;
};

/// Time of the rig now; nothing on a rig that has its own time.
std::optional<client::RigTime> rig_time(const client::ClockSync& clock, std::int64_t now_ns) {
  try {
    return clock.to_rig(now_ns);
  } catch (const client::Error&) {
    return std::nullopt;
  }
}

ClockFindings find_out(Session& session, const ClockOptions& options) {
  using Clock = std::chrono::steady_clock;
  catch_interrupts();
  client::Client client = session.connect();
  const client::ClockSync clock(client, {.max_drift_ppm = options.max_drift_ppm});
  const auto until = Clock::now() + std::chrono::duration<double>(options.seconds);
  while (!interrupted() && Clock::now() < until) {
    if (const auto problem = clock.problem()) throw *problem;
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
  const std::int64_t now_ns = client::ClockSync::now_ns();
  return {clock.bounds(), clock.drift(), clock.exchanges(), rig_time(clock, now_ns), now_ns, client.clock()};
}

std::string drift_words(const client::ClockDrift& drift) {
  if (drift.over_s == 0.0) return fmt::format("not known yet (±{:g} ppm stated)", drift.bound_ppm);
  return fmt::format("{:.1f} ppm ± {:.1f} ppm over {:.1f} s", drift.ppm, drift.bound_ppm, drift.over_s);
}

std::string utc_words(const v1::ClockState& state) {
  std::string words = spaced(word(state.utc_state()));
  if (state.has_utc_max_error_ms()) words += fmt::format(" within {:.3f} ms", state.utc_max_error_ms());
  if (state.has_kernel_frequency_ppm())
    words += fmt::format(", oscillator corrected by {:.3f} ppm", state.kernel_frequency_ppm());
  words += ", kept by ";
  for (int i = 0; i < state.kept_by_size(); ++i) words += (i == 0 ? "" : ", ") + state.kept_by(i);
  return words;
}

Json findings_json(const ClockFindings& found) {
  Json rig;
  if (found.rig) {
    rig = {{"rig_ns", found.rig->rig_ns}, {"this_ns", found.now_ns}, {"bound_ms", found.rig->bound_ms}};
  }
  return {{"clock",
           {{"offset_ns", found.bounds.offset_ns()},
            {"lower_ns", found.bounds.lower_ns},
            {"upper_ns", found.bounds.upper_ns},
            {"bound_ms", found.bounds.bound_ms()},
            {"drift_ppm", found.drift.ppm},
            {"drift_bound_ppm", found.drift.bound_ppm},
            {"exchanges", found.exchanges}}},
          {"rig", rig},
          {"daemon", to_json(found.daemon)}};
}

void show_clock(Session& session, const ClockOptions& options) {
  const ClockFindings found = find_out(session, options);
  if (session.json) return print_json(findings_json(found));
  const Terminal terminal = Terminal::detect();
  TextTable table;
  table.add({terminal.bold("offset"),
             fmt::format("{:.6f} ms ± {:.4f} ms: CLOCK_MONOTONIC of the daemon minus that of this machine",
                         1e-6 * static_cast<double>(found.bounds.offset_ns()), found.bounds.bound_ms())});
  table.add({terminal.bold("drift"), drift_words(found.drift)});
  table.add({terminal.bold("exchanges"), fmt::format("{}", found.exchanges)});
  const v1::ClockState& daemon = found.daemon;
  table.add({terminal.bold("rig"),
             found.rig ? fmt::format("{:.6f} s after its start ± {:.4f} ms",
                                     1e-9 * static_cast<double>(found.rig->rig_ns), found.rig->bound_ms)
                       : "not known: no tick yet, or a time of its own"});
  table.add({terminal.bold("UTC there"),
             fmt::format("{:.6f} s after CLOCK_MONOTONIC (± {} ns)",
                         1e-9 * static_cast<double>(daemon.utc_ns() - daemon.monotonic_ns()),
                         daemon.read_apart_ns())});
  table.add({terminal.bold("kept"), utc_words(daemon)});
  for (const std::string& line : table.lines(terminal)) print_line(line);
}

}  // namespace

void add_clock_command(CLI::App& app, Session& session) {
  CLI::App* command = app.add_subcommand("clock", "How the daemon's clock stands to this one, and to UTC");
  const auto options = std::make_shared<ClockOptions>();
  command->add_option("--seconds", options->seconds, "How long stamps are exchanged")
      ->check(CLI::Range(0.1, 3600.0))
      ->capture_default_str();
  command
      ->add_option("--max-drift", options->max_drift_ppm,
                   "ppm by which the clocks run apart at most; the bounds hold where this does")
      ->check(CLI::Range(0.001, 10000.0))
      ->capture_default_str();
  command->footer("Examples:\n  hapticctl clock\n  hapticctl --server lab1:50051 clock --seconds 60");
  command->callback([&session, options] { show_clock(session, *options); });
}

}  // namespace hapticd::cli
