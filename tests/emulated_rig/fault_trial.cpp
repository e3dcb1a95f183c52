#include "tests/emulated_rig/fault_trial.h"

#include <algorithm>

namespace hapticd::test {

namespace {

using rt::FaultAction;
using rt::FaultClearing;
using rt::GuardFault;
using rt::GuardState;
using rt::TickRecord;

constexpr double kHandN = 2.0;
constexpr double kClearForceN = 0.3;
constexpr double kSteadyForceN = 0.6;
constexpr double kNoForceN = 0.02;
constexpr double kStallMs = 20.0;

double force_of(const TickRecord& record) {
  return magnitude(record.device_command_n);
}

sim::HandProgram pressing() {
  sim::HandProgram hand;
  hand.kind = sim::HandProgram::Kind::kPress;
  hand.force_n = kHandN;
  hand.approach_mm_per_s = 60.0;
  hand.travel_s = 0.3;
  hand.force_rate_n_per_s = 5.0;
  hand.hold_s = -1.0;
  return hand;
}

sim::HandProgram lifting() {
  sim::HandProgram hand;
  hand.travel_s = 0.3;
  return hand;
}

/// Faults that take the force away.
constexpr rt::FaultSet kTakesForce =
    rt::faults_that([](const rt::FaultRule& rule) { return rule.action != FaultAction::kWarn; });

class Trial {
 public:
  Trial(Run& run, const FaultPlan& plan) : run_(run), plan_(plan), rule_(rt::rule_of(plan.fault)) {}

  FaultTrial take() {
    if (press() && strike()) {
      if (rule_.action == FaultAction::kWarn) {
        endure();
      } else if (fall()) {
        recover();
      }
      settle();
      keep_series();
      if (trial_.spoilt.empty()) press_again();
    }
    look_for_stalls();
    return std::move(trial_);
  }

 private:
  const TickRecord& at(std::size_t place) const { return run_.records()[place]; }
  std::size_t count() const { return run_.records().size(); }
  std::size_t place_of(std::uint64_t tick) const { return run_.place_of(tick); }

  /// Largest change of the force in a period. A tick that is late on a busy machine has the steps of several.
  double largest_step(std::size_t from, std::size_t to) const {
    constexpr double kPeriodNs = 1e6;
    double largest = 0.0;
    for (std::size_t i = std::max<std::size_t>(from, 1); i < std::min(to, count()); ++i) {
      const double periods = static_cast<double>(at(i).time_ns - at(i - 1).time_ns) / kPeriodNs;
      const double step_n = magnitude(at(i).device_command_n - at(i - 1).device_command_n);
      largest = std::max(largest, step_n / std::max(1.0, periods));
    }
    return largest;
  }
  double mean_force(std::size_t ticks) const {
    const std::size_t n = std::min(ticks, count());
    double sum = 0.0;
    for (std::size_t i = count() - n; i < count(); ++i) sum += force_of(at(i));
    return n > 0 ? sum / static_cast<double>(n) : 0.0;
  }
  bool rendering() const { return run_.last().guard_state == GuardState::kRendering; }
  bool spoilt(const std::string& why) {
    trial_.spoilt = why;
    return false;
  }
  void settle() const {
    if (plan_.settled) plan_.settled();
  }
  void problem(const std::string& what) { trial_.problems.push_back(what); }

  bool press() {
    // A pause of the machine as the tip meets the object leaves a load that no contact began with, and one
    // later may end the contact: the hand lifts off then and presses once more.
    bool renders = false;
    std::size_t begun = 0;  // of the attempt that counts
    for (int attempt = 0; attempt < 3 && !renders; ++attempt) {
      if (attempt > 0) {
        run_.set_hand({});
        run_.pass(2.0);
      }
      begun = count();
      run_.set_hand(pressing());
      renders = run_.until(
          [&] { return !rendering() || (run_.last().in_contact && force_of(run_.last()) > kClearForceN); },
          8.0);
      if (!renders || !rendering()) continue;
      run_.pass(1.2);
      renders = !rendering() || mean_force(100) > kSteadyForceN;
    }
    if (!renders) return spoilt("no force was rendered in contact");
    if (!rendering())
      return spoilt("before the fault: " + std::string(rt::rule_of(run_.last().guard_fault).name));
    while (begun < count() && !at(begun).in_contact) ++begun;
    trial_.step_before_n = largest_step(begun, count());
    trial_.force_before_n = mean_force(100);
    return true;
  }

  bool strike() {
    plan_.inject();
    std::optional<std::uint64_t> aware;
    const bool known = run_.until(
        [&] {
          aware = plan_.aware();
          return aware && run_.last().tick >= *aware;
        },
        5.0);
    if (!known) return spoilt("the fault could not be made");
    trial_.aware_tick = *aware;
    return true;
  }

  /// Waits until the force is zero, as the guard commands it and at the device.
  bool fall() {
    const std::size_t aware = place_of(trial_.aware_tick);
    const auto zero_at = [&]() -> std::optional<std::size_t> {
      for (std::size_t i = aware; i < count(); ++i) {
        if (force_of(at(i)) == 0.0 && at(i).guard_state != GuardState::kRendering) return i;
      }
      return std::nullopt;
    };
    if (!run_.until([&] { return zero_at().has_value(); }, 3.0)) {
      problem("the force did not become zero");
      return false;
    }
    const std::size_t zero = *zero_at();
    trial_.ticks_to_zero = static_cast<int>(zero - aware);
    for (std::size_t i = aware; i <= zero; ++i) {
      if (rule_.sample_status == 0 || (at(i).sample_status & rule_.sample_status) == 0) continue;
      trial_.status_ticks_to_zero = static_cast<int>(zero - i);
      break;
    }
    trial_.state = at(zero).guard_state;
    trial_.reported = at(zero).guard_fault;
    if (!latches()) return true;

    run_.pass(0.3);
    if (plan_.lasts) {
      trial_.refused_while_it_lasted = run_.clear().status == rt::EngineOutcome::Status::kFaultPersists;
      if (!*trial_.refused_while_it_lasted) problem("the latch could be left while the fault lasted");
    }
    for (std::size_t i = zero; i < count(); ++i) {
      if (force_of(at(i)) != 0.0) {
        problem("force before the latch was left");
        break;
      }
    }
    return true;
  }

  bool latches() const { return rule_.clearing != FaultClearing::kItself; }

  void recover() {
    const std::size_t zero = place_of(trial_.aware_tick) + static_cast<std::size_t>(*trial_.ticks_to_zero);
    const std::size_t until_fixed = count();
    if (plan_.fix) plan_.fix();
    std::size_t from = 0;
    if (latches()) {
      // Clean for a fifth of a second.
      std::size_t clean = 0;
      std::size_t looked = count();
      const bool fixed = run_.until(
          [&] {
            for (; looked < count(); ++looked) {
              clean = (at(looked).faults_present & kTakesForce) == 0 ? clean + 1 : 0;
            }
            return clean >= 200;
          },
          10.0);
      if (!fixed) return problem("the fault stayed after it was fixed");
      for (std::size_t i = zero; i < count(); ++i) {
        if (force_of(at(i)) != 0.0) return problem("force before the latch was left");
      }
      if (run_.last().guard_state != GuardState::kLatched) problem("it was not latched");
      settle();
      const rt::EngineOutcome outcome = run_.clear();
      if (outcome.status != rt::EngineOutcome::Status::kApplied) return problem("it could not be cleared");
      run_.until([&] { return run_.last().tick >= outcome.tick; }, 5.0);
      from = place_of(outcome.tick);
    } else {
      const auto resuming = [&] {
        for (std::size_t i = zero; i < count(); ++i) {
          if (at(i).guard_state == GuardState::kResuming) return i;
        }
        return std::size_t{0};
      };
      if (!run_.until([&] { return resuming() != 0; }, 5.0)) return problem("it did not come back by itself");
      from = resuming();
      settle();
    }
    for (std::size_t i = place_of(trial_.aware_tick); i < std::max(until_fixed, zero + 1); ++i) {
      trial_.present |= at(i).faults_present;
    }
    if (!run_.until([&] { return rendering() && run_.last().authority == 1.0; }, 5.0)) {
      return run_.last().guard_state == GuardState::kResuming
                 ? problem("authority did not come back")
                 : static_cast<void>(
                       spoilt("while it resumed: " + std::string(rt::rule_of(run_.last().guard_fault).name)));
    }
    run_.pass(0.2);
    trial_.recovery_step_n = largest_step(from, count());
    trial_.recovered_n = mean_force(50);
    check_told();
  }

  void check_told() {
    const GuardState wanted = latches() ? GuardState::kLatched : GuardState::kSuspended;
    if (trial_.state != wanted) problem("the guard was in another state than the table says");
    if ((trial_.present & rt::set_of(plan_.fault)) == 0 && plan_.fault != GuardFault::kStopped) {
      problem("the fault was not reported");
    }
    if (trial_.reported == plan_.fault || trial_.reported == plan_.first) return;
    const std::string reported(rt::rule_of(trial_.reported).name);
    const bool by_the_machine = plan_.live && (trial_.reported == GuardFault::kSensorStale ||
                                               trial_.reported == GuardFault::kLoopGap);
    if (by_the_machine) {
      spoilt("instead of the fault: " + reported);
    } else {
      problem("reported instead: " + reported);
    }
  }

  /// A warning: force goes on.
  void endure() {
    const std::size_t from = place_of(trial_.aware_tick);
    run_.pass(0.5);
    if (plan_.fix) plan_.fix();
    run_.pass(0.2);
    double least = trial_.force_before_n;
    for (std::size_t i = from; i < count(); ++i) {
      trial_.present |= at(i).faults_present;
      least = std::min(least, force_of(at(i)));
    }
    trial_.state = run_.last().guard_state;
    trial_.recovery_step_n = largest_step(from, count());
    trial_.recovered_n = mean_force(50);
    if (!rendering()) {
      if (plan_.live) {
        spoilt("instead of the warning: " + std::string(rt::rule_of(run_.last().guard_fault).name));
      } else {
        problem("a warning took the force away");
      }
    } else if (least < 0.7 * trial_.force_before_n) {
      problem("a warning changed the force");
    }
    if ((trial_.present & rt::set_of(plan_.fault)) == 0) problem("the warning was not reported");
  }

  /// True once the tool is free.
  bool lift() {
    run_.set_hand(lifting());
    // The object springs after the tip that leaves it: free for a fifth of a second is lifted.
    std::size_t looked = count();
    std::size_t free = 0;
    return run_.until(
        [&] {
          for (; looked < count(); ++looked) {
            free = !at(looked).in_contact && force_of(at(looked)) < kNoForceN ? free + 1 : 0;
          }
          return free >= 200;
        },
        10.0);
  }

  void press_again() {
    const std::size_t from = count();
    bool renders = false;
    for (int attempt = 0; attempt < 3 && !renders && lift(); ++attempt) {  // as in press()
      run_.set_hand(pressing());
      renders = run_.until(
          [&] {
            return !rendering() || (run_.last().in_contact && mean_force(50) > 0.7 * trial_.force_before_n);
          },
          8.0);
    }
    run_.pass(0.3);
    trial_.step_again_n = largest_step(from, count());
    trial_.force_again_n = mean_force(50);
    if (!rendering()) {
      spoilt("when pressed again: " + std::string(rt::rule_of(run_.last().guard_fault).name));
    } else if (!renders) {
      problem("no force when pressed again");
    }
  }

  /// How the machine did, and what the device itself gave.
  void look_for_stalls() {
    if (!run_.whole()) spoilt("records of ticks were lost");
    if (trial_.aware_tick == 0) return;
    const TappedRig& rig = run_.rig();
    const auto aware = static_cast<std::size_t>(trial_.aware_tick);
    for (std::size_t tick = aware; plan_.device_obeys && tick + 1 < rig.marks(); ++tick) {
      if (rule_.action == FaultAction::kWarn || rig.mark(tick + 1).standing_n != 0.0) continue;
      trial_.device_ticks_to_zero = static_cast<int>(tick - aware);
      break;
    }
    if (!plan_.live) return;
    for (std::size_t tick = std::max<std::size_t>(aware, 101) - 100; tick + 1 < rig.marks(); ++tick) {
      if (plan_.stalls && tick + 1 >= aware && tick <= aware) continue;  // the fault itself
      const double gap_ms =
          1e-6 * static_cast<double>(rig.mark(tick + 1).monotonic_ns - rig.mark(tick).monotonic_ns);
      if (gap_ms > kStallMs) {
        spoilt("the machine stalled for " + std::to_string(static_cast<int>(gap_ms)) + " ms");
        return;
      }
    }
  }

  void keep_series() {
    const std::size_t aware = place_of(trial_.aware_tick);
    for (std::size_t i = aware - std::min<std::size_t>(aware, 100); i < count(); ++i) {
      trial_.ticks.push_back(static_cast<double>(i) - static_cast<double>(aware));
      trial_.force_n.push_back(force_of(at(i)));
    }
  }

  Run& run_;
  const FaultPlan& plan_;
  const rt::FaultRule& rule_;
  FaultTrial trial_;
};

}  // namespace

FaultTrial observe(Run& run, const FaultPlan& plan) {
  return Trial(run, plan).take();
}

}  // namespace hapticd::test
