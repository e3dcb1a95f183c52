#include "server/diagnosis/diagnosis.h"

#include <fmt/format.h>

#include <chrono>
#include <cmath>
#include <iterator>
#include <thread>

#include "rt/guard/fault_table.h"
#include "server/diagnosis/force_monitor.h"
#include "server/diagnosis/machine_findings.h"
#include "server/scene/scene_host.h"
#include "server/session/session.h"
#include "server/telemetry/telemetry_hub.h"
#include "server/turntable/turntable_host.h"

namespace hapticd::server {

namespace {

using enum FindingSeverity;
using Clock = std::chrono::steady_clock;

/// How long the loop and the force are observed.
constexpr std::chrono::milliseconds kWatched{500};
constexpr double kTolerableRateError = 0.01;
/// Ticks that are later than this share of a period can be felt as jitter.
constexpr double kTolerableLateness = 0.25;

Findings examine_loop(Session& session) {
  Findings findings;
  if (!session.running()) {
    findings.push_back(
        {kProblem, "loop", "does not run", "start the daemon again; its log says why it ended"});
    return findings;
  }
  const double wanted_hz = session.rig_info().rate_hz;
  if (!session.rig_owns_clock()) {
    const auto began = Clock::now();
    const std::uint64_t first = session.statistics().ticks;
    std::this_thread::sleep_for(kWatched);
    const double seconds = std::chrono::duration<double>(Clock::now() - began).count();
    const double rate_hz = static_cast<double>(session.statistics().ticks - first) / seconds;
    const bool close = std::abs(rate_hz / wanted_hz - 1.0) <= kTolerableRateError;
    findings.push_back(
        {close           ? kGood
         : rate_hz > 0.0 ? kWarning
                         : kProblem,
         "loop", fmt::format("{:.0f} ticks a second, {:g} wanted", rate_hz, wanted_hz),
         close ? "" : "see which of timer, computation and device is late (hapticctl status)"});
    const rt::LoopStatistics statistics = session.statistics();
    const double late_us = 1e-3 * static_cast<double>(statistics.wakeup.quantile_ns(0.999));
    const bool prompt = late_us <= kTolerableLateness * 1e6 / wanted_hz;
    findings.push_back({prompt ? kGood : kWarning, "loop",
                        fmt::format("one tick in a thousand is later than {:.0f} µs; {} periods missed of {}",
                                    late_us, statistics.periods_missed, statistics.ticks),
                        prompt ? "" : "real-time kernel, isolated CPU, priority: see the findings on those"});
  }
  findings.push_back(examine_ticking_thread(session.ticking_thread(), session.loop_config()));
  for (const std::string& shortcoming : session.realtime_shortcomings()) {
    const std::size_t semicolon = shortcoming.find("; ");
    const bool splits = semicolon != std::string::npos;
    findings.push_back({kWarning, "loop", shortcoming.substr(0, semicolon),
                        splits ? shortcoming.substr(semicolon + 2) : std::string()});
  }
  return findings;
}

/// The records of the loaded scene for half a second from construction on, if it uses the force sensor.
class SceneMonitor {
 public:
  explicit SceneMonitor(const Diagnosed& rig) : rig_(rig), scene_(rig.scenes.current()) {
    if (scene_ && (scene_->outline.channels & rt::channel::kZero) == 0) scene_.reset();
    if (!scene_) return;
    SubscriptionOptions all;
    all.batch_size = all.queue_samples;
    all.longest_wait = std::chrono::milliseconds(0);
    records_ = rig.hub.subscribe(all);
  }
  ~SceneMonitor() {
    if (records_) rig_.hub.unsubscribe(records_);
  }
  SceneMonitor(const SceneMonitor&) = delete;
  SceneMonitor& operator=(const SceneMonitor&) = delete;

  /// Waits for the rest of the half second. Nothing if another scene was loaded meanwhile.
  Findings findings() {
    if (!scene_ || !rig_.session.running()) return {};
    std::this_thread::sleep_until(began_ + kWatched);
    rig_.hub.flush();
    ForceMonitor watch(scene_->spec);
    Subscription::Batch batch;
    records_->take(batch, Clock::now());
    for (const Subscription::Entry& entry : batch.entries) watch.add(entry.record());
    return rig_.scenes.current() == scene_ ? watch.findings() : Findings{};
  }

 private:
  const Diagnosed& rig_;
  std::shared_ptr<const ResolvedScene> scene_;
  std::shared_ptr<Subscription> records_;
  Clock::time_point began_ = Clock::now();
};

Findings examine_turntable(TurntableHost& turntable, bool probe) {
  const bool opens = probe && turntable.table()->status().state == hal::TurntableState::kIdle;
  if (!opens) return examine_part(turntable.table()->report());
  const auto engaged = turntable.engage();
  if (!engaged) {
    const hal::Error& error = engaged.refusal().error;
    return {{kProblem, "turntable", error.text(), error.remedy}};
  }
  Findings findings = examine_part(turntable.table()->report());
  if (const auto released = turntable.disengage(); !released) {
    findings.push_back({kWarning, "turntable", released.refusal().error.text(), ""});
  }
  return findings;
}

/// The last fault of the device, while the device itself reports none any more.
std::string last_device_fault(const std::vector<hal::PartReport>& reports) {
  for (const hal::PartReport& report : reports) {
    if (report.part == "haptic device") return report.last_fault;
  }
  return {};
}

}  // namespace

Findings examine_part(const hal::PartReport& report) {
  Findings findings;
  const std::string name =
      report.connection.empty() ? report.driver : report.driver + ", " + report.connection;
  switch (report.state) {
    case hal::PartState::kIdle:
      findings.push_back({kNote, report.part, name + ": not in use, nothing of it is open", ""});
      break;
    case hal::PartState::kConnecting:
      findings.push_back(
          {kProblem, report.part, name + ": nothing comes", "check supply, cable and address"});
      break;
    case hal::PartState::kReady:
      findings.push_back({kGood, report.part, name + ": delivers", ""});
      break;
    case hal::PartState::kFaulty:
      findings.push_back({kProblem, report.part, name + ": reports a fault", "see the findings that follow"});
      break;
  }
  for (const std::string& finding : report.findings) {
    findings.push_back(
        {report.state == hal::PartState::kFaulty ? kProblem : kWarning, report.part, finding, ""});
  }
  return findings;
}

Findings examine_guard(const rt::TickRecord& newest, const std::vector<hal::PartReport>& reports) {
  if (newest.guard_state != rt::GuardState::kLatched || newest.guard_fault == rt::GuardFault::kNone)
    return {};
  const rt::FaultRule& rule = rt::rule_of(newest.guard_fault);
  // A stop is intended; all other faults keep the device from working.
  const bool wanted = newest.guard_fault == rt::GuardFault::kStopped;
  std::string cause(rule.cause);
  std::string remedy(rule.remedy);
  if (newest.guard_fault == rt::GuardFault::kDeviceFault) {
    // The rule's remedy leads here.
    remedy = "check cable and supply of the device, then start again";
    if (const std::string last = last_device_fault(reports); !last.empty()) cause += " (last: " + last + ")";
  }
  return {{wanted ? kWarning : kProblem, "guard",
           fmt::format("latched, {}: {}; no force until it is cleared", rule.name, cause),
           wanted ? "hapticctl clear, when the reason is gone"
                  : fmt::format("{}; then hapticctl clear", remedy)}};
}

Findings diagnose(const Diagnosed& rig, bool probe) {
  Session& session = rig.session;
  TurntableHost& turntable = rig.turntable;
  Findings findings = examine_machine(session.loop_config());
  const auto add = [&findings](Findings more) {
    findings.insert(findings.end(), std::make_move_iterator(more.begin()),
                    std::make_move_iterator(more.end()));
  };
  SceneMonitor scene(rig);
  add(examine_loop(session));
  add(examine_guard(rig.hub.latest(), session.part_reports()));
  add(scene.findings());
  const Session::Probe looked = probe ? session.probe_parts() : Session::Probe{session.part_reports(), {}};
  if (looked.error)
    findings.push_back({kProblem, "force sensor", looked.error->text(), looked.error->remedy});
  for (const hal::PartReport& report : looked.reports) add(examine_part(report));
  if (turntable.table() != nullptr) add(examine_turntable(turntable, probe));
  return findings;
}

}  // namespace hapticd::server
