#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include "rt/guard/fault_table.h"
#include "tests/emulated_rig/fault_cases.h"
#include "tests/measure/study/common/parts.h"

namespace hapticd::study {

namespace {

using report::fixed;
using test::FaultPlan;
using test::FaultTrial;

constexpr int kMaxAttempts = 3;
constexpr double kTickGoal = 2.0;

struct Attempted {
  FaultTrial trial;
  int attempts = 0;
  std::optional<std::uint64_t>
      ages_passed_on_as_young{};  ///< ticks of the last attempt; none if no rig does that
};

const char* to_text(rt::GuardState state) {
  switch (state) {
    case rt::GuardState::kRendering:
      return "rendering";
    case rt::GuardState::kResuming:
      return "resuming";
    case rt::GuardState::kLatched:
      return "latched";
    case rt::GuardState::kSuspended:
      return "suspended";
  }
  return "";
}

std::string names_of(rt::FaultSet faults) {
  std::string names;
  for (const rt::FaultRule& rule : rt::kFaultTable) {
    if ((faults & rt::set_of(rule.fault)) != 0) names += (names.empty() ? "" : ", ") + std::string(rule.name);
  }
  return names.empty() ? report::kNoNumber : names;
}

std::string ticks(const std::optional<int>& count) {
  return count ? std::to_string(*count) : std::string(report::kNoNumber);
}

template <class Rig, class Make>
Attempted attempt(const test::FaultCase<Rig>& fault, Make make) {
  Attempted attempted;
  while (attempted.attempts < kMaxAttempts) {
    ++attempted.attempts;
    const auto rig = make();
    const FaultPlan plan = fault.plan(*rig);
    attempted.trial = test::observe(*rig, plan);
    if constexpr (requires { rig->forgiven(); }) attempted.ages_passed_on_as_young = rig->forgiven();
    if (attempted.trial.spoilt.empty()) break;
    report::Report::note(fault.name + ": " + attempted.trial.spoilt);
  }
  return attempted;
}

class FaultReport {
 public:
  explicit FaultReport(StudyContext& context)
      : context_(context),
        table_({"fault", "peer", "what it does", "action", "ticks to zero", "at the device", "guard",
                "reported as", "all faults reported", "refused while it lasts", "N before", "step before N",
                "recovery step N", "N recovered", "step pressing again N", "attempts",
                "ages passed on as 1 ms", "verdict"}) {
    for (report::Plot* plot : {&fall_, &recovery_}) {
      plot->x = {"after the first that could know", "ticks"};
      plot->y = {"device force", "N"};
      plot->y.minimum = 0.0;
    }
    fall_.title = "Force taken away";
    fall_.x.minimum = -10.0;
    fall_.x.maximum = 15.0;
    recovery_.title = "… and given back: at once where filters stayed whole, after lifting where not";
    recovery_.x.minimum = -100.0;
    recovery_.x.maximum = 1300.0;
  }

  template <class Rig>
  void add(const test::FaultCase<Rig>& fault, const Attempted& attempted) {
    const FaultTrial& trial = attempted.trial;
    const rt::FaultRule& rule = rt::rule_of(fault.fault);
    const bool warns = rule.action == rt::FaultAction::kWarn;
    std::string verdict = trial.spoilt.empty() ? "" : "not measured: " + trial.spoilt;
    for (const std::string& problem : trial.problems) verdict += (verdict.empty() ? "" : "; ") + problem;

    report::Case conditions{
        {"fault", std::string(rule.name)}, {"transport", fault.peer}, {"peer", fault.name}};
    if (!warns) {
      report::Figure zero{"fault_to_zero_ticks", conditions};
      zero.goal = rule.action == rt::FaultAction::kRampToZero ? 100.0 + kTickGoal : kTickGoal;
      zero.source = "first tick whose sample could have known to first tick without force";
      if (verdict.empty() && trial.ticks_to_zero) {
        zero.value = *trial.ticks_to_zero;
        if (*zero.value > *zero.goal) verdict = "too late";
      } else {
        zero.failed = verdict.empty() ? "no zero force was seen" : verdict;
      }
      context_.report.add(zero);
    }
    report::Figure step{"recovery_force_step_n", conditions};
    step.unit = "N";
    step.reference = trial.step_before_n;
    step.source = "reference: the largest step in the contact before the fault";
    if (verdict.empty() || verdict == "too late") {
      step.value = trial.recovery_step_n;
    } else {
      step.failed = verdict;
    }
    context_.report.add(step);

    const std::string refused =
        trial.refused_while_it_lasted ? (*trial.refused_while_it_lasted ? "yes" : "no") : report::kNoNumber;
    table_.add_row({std::string(rule.name), fault.peer, fault.action, std::string(rt::to_text(rule.action)),
                    warns ? report::kNoNumber : ticks(trial.ticks_to_zero), ticks(trial.device_ticks_to_zero),
                    to_text(trial.state),
                    trial.reported == rt::GuardFault::kNone ? std::string(report::kNoNumber)
                                                            : std::string(rt::rule_of(trial.reported).name),
                    names_of(trial.present), refused, fixed(trial.force_before_n, 2),
                    fixed(trial.step_before_n, 3), fixed(trial.recovery_step_n, 3),
                    fixed(trial.recovered_n, 2), fixed(trial.step_again_n, 3),
                    std::to_string(attempted.attempts),
                    attempted.ages_passed_on_as_young ? std::to_string(*attempted.ages_passed_on_as_young)
                                                      : std::string(report::kNoNumber),
                    verdict.empty() ? "as the table says" : verdict});
    report::Report::note(fault.peer + ", " + fault.name + ": " + ticks(trial.ticks_to_zero) + " ticks, " +
                         (verdict.empty() ? "as the table says" : verdict));
    const char* label = label_of(fault.name);
    if (label == nullptr) return;
    report::PlotSeries series{.name = label, .mark = report::PlotMark::kOfColor};
    for (std::size_t i = 0; i < trial.ticks.size(); ++i) {
      if (trial.ticks[i] < -10.0 || trial.ticks[i] > 15.0) continue;
      series.add(trial.ticks[i], trial.force_n[i]);
    }
    fall_.series.push_back(series);
    recovery_.series.push_back({.name = label, .points = cli::points_of(trial.ticks, trial.force_n)});
  }

  void write() {
    context_.report.add_table(
        "faults", "Every fault, from the peer to the hand", table_,
        "A simulated hand presses with 2 N on a sponge that is rendered at 0.7 N/mm; the fault is made at "
        "the "
        "peer. Ticks to zero: from the first tick whose sample could have known (that begins after the "
        "faulty "
        "record or frame was sent; of silence, the first without a sample) to the first with no force "
        "commanded, 0 = the same tick. At the device: the same for the force the stand-in's motors or the "
        "board's outputs give. Then the latch is tried while the fault lasts, the fault is fixed, the force "
        "is seen to stay zero, the latch is cleared. Recovery step: largest change of the force from one "
        "tick to "
        "the next, from the clear (or the end of the fault) until 0.2 s after all of it is given; a scene "
        "whose "
        "filters were reset renders only after the tool was lifted, so the hand then lifts and presses "
        "again: "
        "step pressing again. Netft and openhaptics are live; the others run in virtual time. Live, but for "
        "the "
        "time of a fault of the box's own, "
        "samples that are older than 1 ms because this machine paused are passed on as 1 ms old (guard limit "
        "2 "
        "ms); a pause of more than 20 ms, or another fault than the one made, spoils an attempt.");
    context_.report.add_plot("faults_fall", fall_);
    context_.report.add_plot("faults_recovery", recovery_);
  }

 private:
  /// Label of those that are plotted.
  static const char* label_of(const std::string& name) {
    if (name == "silence") return "sensor silent";
    if (name == "unplugged") return "device unplugged";
    if (name == "exceeded_velocity") return "device too fast";
    if (name == "warm_error") return "motors warm";
    if (name == "stall_70_ms") return "loop gap 70 ms";
    return nullptr;
  }

  StudyContext& context_;
  report::MarkdownTable table_;
  report::Plot fall_;
  report::Plot recovery_;
};

/// Whether a quick run has it.
bool is_quick(const std::string& name) {
  for (const char* quick : {"silence", "status_cpu", "unplugged", "warm_error", "gauge_at_rail", "stop"}) {
    if (name == quick) return true;
  }
  return false;
}

}  // namespace

void run_faults(StudyContext& context) {
  FaultReport report(context);
  for (const auto& fault : test::live_fault_cases()) {
    if (context.quick && !is_quick(fault.name)) continue;
    report.add(fault,
               attempt(fault, [] { return std::make_unique<test::EmulatedRig>(test::rig_for_faults({})); }));
  }
  for (const auto& fault : test::board_fault_cases()) {
    if (context.quick && !is_quick(fault.name)) continue;
    report.add(fault,
               attempt(fault, [] { return std::make_unique<test::BoardRig>(test::board_for_faults()); }));
  }
  report.write();
}

}  // namespace hapticd::study
