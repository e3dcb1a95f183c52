#include "server/identification/gate/sample_gate.h"

#include <gtest/gtest.h>

#include <limits>

namespace hapticd::identification {
namespace {

using Verdict = SampleGate::Verdict;
namespace status = hal::sample_status;

hal::RigInfo rig_of(double rate_hz) {
  hal::RigInfo rig;
  rig.rate_hz = rate_hz;
  rig.sensor.range_n = 10.0;
  return rig;
}

/// What each kind of identification makes of one sample that follows a fit one.
struct Verdicts {
  Verdict palpation, stroke, tool, threshold, gains, structural;
  bool operator==(const Verdicts&) const = default;
};

template <class Spoil>
Verdicts verdicts(const Spoil& spoil, double rate_hz = 1000.0) {
  const hal::RigInfo rig = rig_of(rate_hz);
  const auto second = [&](const SamplePolicy& policy) {
    SampleGate gate(policy);
    rt::Observation o;
    o.sample.time_ns = 1'000'000'000;
    EXPECT_EQ(gate.judge(o), Verdict::kUse);
    o.sample.time_ns += static_cast<std::int64_t>(1e9 / rate_hz);
    spoil(o);
    return gate.judge(o);
  };
  return {second(palpation_policy(rig)), second(stroke_policy(rig)), second(tool_policy(rig)),
          second(threshold_policy()),    second(gains_policy()),     second(structural_policy(rig, true))};
}

Verdicts with_status(std::uint32_t bits) {
  return verdicts([bits](rt::Observation& o) { o.sample.status = bits; });
}

constexpr Verdict kUse = Verdict::kUse, kSkip = Verdict::kSkip, kInterrupt = Verdict::kInterrupt,
                  kRestart = Verdict::kRestart;

TEST(SampleGate, EachKindHasItsPolicyForTheStatus) {
  EXPECT_EQ(with_status(0), (Verdicts{kUse, kUse, kUse, kUse, kUse, kUse}));
  EXPECT_EQ(with_status(status::kForceMissing), (Verdicts{kSkip, kSkip, kSkip, kSkip, kSkip, kUse}));
  EXPECT_EQ(with_status(status::kForceSaturated),
            (Verdicts{kSkip, kSkip, kInterrupt, kInterrupt, kSkip, kUse}));
  EXPECT_EQ(with_status(status::kDeviceFault),
            (Verdicts{kSkip, kSkip, kInterrupt, kInterrupt, kSkip, kInterrupt}));
  EXPECT_EQ(with_status(status::kDeviceWarm), (Verdicts{kUse, kSkip, kUse, kUse, kUse, kUse}));
}

TEST(SampleGate, EachKindHasItsLongestStep) {
  const auto after = [](std::int64_t more_ms) {
    return verdicts([more_ms](rt::Observation& o) { o.sample.time_ns += more_ms * 1'000'000; });
  };
  EXPECT_EQ(after(3), (Verdicts{kUse, kUse, kUse, kUse, kUse, kUse}));
  EXPECT_EQ(after(5), (Verdicts{kRestart, kUse, kUse, kUse, kUse, kUse}));
  EXPECT_EQ(after(16), (Verdicts{kRestart, kRestart, kRestart, kRestart, kRestart, kRestart}));
  EXPECT_EQ(after(-1), (Verdicts{kSkip, kSkip, kSkip, kSkip, kSkip, kSkip}));
  // At 100 Hz: five periods, or three.
  const auto slow = [](std::int64_t more_ms) {
    return verdicts([more_ms](rt::Observation& o) { o.sample.time_ns += more_ms * 1'000'000; }, 100.0);
  };
  EXPECT_EQ(slow(25), (Verdicts{kUse, kUse, kRestart, kRestart, kRestart, kRestart}));
  EXPECT_EQ(slow(45), (Verdicts{kRestart, kRestart, kRestart, kRestart, kRestart, kRestart}));
}

TEST(SampleGate, EachKindHasItsEndOfRange) {
  const auto under = [](const hal::Vector3& force_n) {
    return verdicts([&force_n](rt::Observation& o) { o.sample.sensor_force_n = force_n; });
  };
  EXPECT_EQ(under({0.0, 0.0, -9.96}), (Verdicts{kUse, kSkip, kUse, kUse, kUse, kUse}));
  EXPECT_EQ(under({0.0, 0.0, -9.995}), (Verdicts{kSkip, kSkip, kUse, kUse, kUse, kUse}));
  EXPECT_EQ(under({8.0, 8.0, 0.0}), (Verdicts{kUse, kSkip, kUse, kUse, kUse, kUse}));
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(under({nan, 0.0, 0.0}), (Verdicts{kUse, kSkip, kInterrupt, kInterrupt, kSkip, kInterrupt}));
  EXPECT_EQ(under({2e4, 0.0, 0.0}), (Verdicts{kUse, kSkip, kInterrupt, kInterrupt, kUse, kUse}));
}

TEST(SampleGate, CountsAndNamesWhatItLeavesOut) {
  SampleGate gate(tool_policy(rig_of(1000.0)));
  rt::Observation o;
  for (int i = 0; i < 100; ++i) {
    o.sample.time_ns += i == 50 ? 40'000'000 : 1'000'000;
    o.sample.force_age_ns = i == 10 ? 30'000'000 : 0;
    o.sample.status = i == 20 || i == 21 ? status::kForceMissing : 0;
    gate.judge(o);
  }
  EXPECT_EQ(gate.judged(), 100U);
  EXPECT_EQ(gate.used(), 97U);
  EXPECT_EQ(gate.left_out(Unfit::kStale), 1U);
  EXPECT_EQ(gate.left_out(Unfit::kNoForce), 2U);
  EXPECT_NEAR(gate.watched_s(), 0.138, 1e-9);
  EXPECT_EQ(gate.remarks(), (std::vector<std::string>{"2 samples left out as unfit: no fresh force",
                                                      "1 sample left out as unfit: the force is too old",
                                                      "1 gap in the data, the longest of 0.04 s"}));
}

TEST(SampleGate, WhatFollowsAnInterruptionIsNoGap) {
  SampleGate gate(threshold_policy());
  rt::Observation o;
  o.sample.time_ns = 1'000'000;
  gate.judge(o);
  o.sample.time_ns += 1'000'000;
  EXPECT_EQ(gate.judge(o), kUse);
  EXPECT_DOUBLE_EQ(gate.step_s(), 1e-3);
  o.sample.status = status::kForceLost;
  EXPECT_EQ(gate.judge(o), kInterrupt);
  o.sample.status = 0;
  o.sample.time_ns += 1'000'000'000;
  EXPECT_EQ(gate.judge(o), kUse);
  EXPECT_EQ(gate.step_s(), 0.0);
  EXPECT_EQ(gate.remarks().size(), 1U);
}

}  // namespace
}  // namespace hapticd::identification
