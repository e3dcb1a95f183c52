#include <fmt/format.h>

#include <string>
#include <utility>
#include <vector>

#include "hal/monotonic_clock.h"
#include "hal/phantom/phantom_state.h"

namespace hapticd::phantom {

namespace {

namespace status_bit = hal::sample_status;

/// Each of the troubles with its remedy.
std::vector<std::string> words_of(std::uint32_t trouble, int jumped_joint) {
  std::vector<std::string> words;
  const auto add = [&](std::uint32_t bit, std::string text) {
    if ((trouble & bit) != 0) words.push_back(std::move(text));
  };
  add(kCountersFail, "the encoders' counts cannot be read: check the board");
  add(kOutputsFail,
      "the board does not accept the motors' volts: switch the amplifiers off and check the board");
  add(kEncoderJumped,
      fmt::format("the encoder of joint {} has jumped: check its cable, then home the arm again",
                  jumped_joint));
  add(kBeyondStops, "the arm seems beyond its stops: it was not in its reset pose when homed; home it again");
  add(kTooHot, "a motor is too hot: no force until it has cooled");
  return words;
}

}  // namespace

hal::PartReport PhantomDevice::report() const {
  const State& state = *state_;
  hal::PartReport report;
  report.part = "haptic device";
  report.driver = "phantom";
  const bool engaged = state.engaged.load(std::memory_order_acquire);
  const bool homed = state.homed.load(std::memory_order_acquire);
  const std::uint32_t trouble = engaged ? state.trouble.load(std::memory_order_relaxed) : 0;
  const std::uint32_t status = engaged ? state.status.load(std::memory_order_relaxed) : 0;
  report.state = !engaged       ? hal::PartState::kIdle
                 : trouble != 0 ? hal::PartState::kFaulty
                 : homed        ? hal::PartState::kReady
                                : hal::PartState::kConnecting;

  const auto find = [&](bool holds, std::string text) {
    if (holds) report.findings.push_back(std::move(text));
  };
  const std::uint64_t wanted = state.home_wanted.load(std::memory_order_acquire);
  const bool homing = state.home_taken.load(std::memory_order_acquire) < wanted;
  find(engaged && homing, "homing: keep the arm still in its reset pose");
  find(engaged && !homed && !homing, "not homed: put the arm in its reset pose and home it");
  const int joint = state.jumped_joint.load(std::memory_order_relaxed) + 1;
  for (std::string& words : words_of(trouble, joint)) report.findings.push_back(std::move(words));
  if (engaged && trouble == 0) {
    const std::vector<std::string> passed =
        words_of(state.last_trouble.load(std::memory_order_relaxed), joint);
    if (!passed.empty()) {
      report.last_fault =
          hal::age_words(hal::monotonic_ns() - state.last_trouble_ns.load(std::memory_order_relaxed)) + ": " +
          passed.front();
    }
  }
  find((status & status_bit::kDeviceWarm) != 0, "a motor is warm: its force is being reduced");
  find((status & status_bit::kDeviceOverSpeed) != 0, "the tip is faster than allowed: no force");
  find((status & status_bit::kDeviceOverForce) != 0, "more force was commanded than the motors may give");

  const auto count = [&](const char* name, std::uint64_t value) {
    report.figures.push_back({name, static_cast<double>(value), ""});
  };
  for (std::size_t i = 0; i < 3; ++i) {
    report.figures.push_back(
        {fmt::format("joint_{}_rad", i + 1), state.q_reported[i].load(std::memory_order_relaxed), "rad"});
  }
  for (std::size_t i = 0; i < 3; ++i) {
    report.figures.push_back(
        {fmt::format("winding_{}_heat", i + 1), state.reported_heat[i].load(std::memory_order_relaxed), "1"});
  }
  count("watchdog_cuts", state.watchdog.cuts());
  count("counter_failures", state.counter_failures.load(std::memory_order_relaxed));
  count("output_failures", state.output_failures.load(std::memory_order_relaxed));
  count("encoder_jumps", state.jumps.load(std::memory_order_relaxed));
  count("unfit_commands", state.unfit_commands.load(std::memory_order_relaxed));
  count("scaled_commands", state.scaled_commands.load(std::memory_order_relaxed));
  count("withheld_commands", state.withheld_commands.load(std::memory_order_relaxed));
  state.board->describe(report);
  return report;
}

}  // namespace hapticd::phantom
