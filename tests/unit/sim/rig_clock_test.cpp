// Virtual and real time: the passing of ticks.

#include <gtest/gtest.h>

#include <cmath>

#include "virtual_rig.h"

namespace hapticd::sim {
namespace {

using test::VirtualRig;

class LoopRate : public testing::TestWithParam<double> {};
INSTANTIATE_TEST_SUITE_P(Hertz, LoopRate, testing::Values(500.0, 1000.0, 3000.0, 10000.0),
                         [](const auto& tested) { return std::to_string(std::lround(tested.param)); });

TEST_P(LoopRate, EveryReadIsOneTickAndOnePeriod) {
  VirtualRig rig({.rate_hz = GetParam()});
  std::int64_t last_ns = 0;
  std::uint64_t samples = 0;
  for (std::uint64_t tick = 0; tick < 20'000; ++tick) {
    rig.tick();
    ASSERT_EQ(rig.sample().tick, tick);
    // The world moves in steps of 0.1 ms; a period that is not a multiple of them may not drift either.
    const double exact_ns = 1e9 * static_cast<double>(tick + 1) / GetParam();
    ASSERT_LE(std::abs(static_cast<double>(rig.sample().time_ns) - exact_ns), 100'000.0);
    ASSERT_GT(rig.sample().time_ns, last_ns);
    // Ten samples of 10 kHz a millisecond.
    ASSERT_EQ(rig.sample().force_count, (rig.sample().time_ns - last_ns) / 100'000);
    ASSERT_EQ(rig.sample().status, 0U);
    last_ns = rig.sample().time_ns;
    samples += rig.sample().force_count;
  }
  EXPECT_NEAR(static_cast<double>(samples), 20'000 * 10'000 / GetParam(), 1.0);
}

TEST_P(LoopRate, AllRatesSeeTheSameWorld) {
  VirtualRig slow({.rate_hz = 500.0}, {.kind = HandProgram::Kind::kTap, .repetitions = -1});
  VirtualRig other({.rate_hz = GetParam()}, {.kind = HandProgram::Kind::kTap, .repetitions = -1});
  slow.run(2.0);
  other.run(2.0 - 1e-6);
  ASSERT_EQ(slow.sample().time_ns, other.sample().time_ns);
  EXPECT_EQ(slow.truth().tip_position_mm.z, other.truth().tip_position_mm.z)
      << "without commands, reading more often changes nothing";
}

// No assertion on timing: only that time, steps and samples agree with each other.
TEST(RealTime, LeapsNoFurtherThanATenthOfASecond) {
  VirtualRig rig({.real_time = true});
  std::int64_t last_ns = 0;
  for (std::uint64_t tick = 0; tick < 300; ++tick) {
    if (tick % 100 == 99) {  // a caller that was away for a while
      for (VirtualRig busy({}); busy.time_s() < 5.0;) busy.tick();
    }
    rig.tick();
    ASSERT_EQ(rig.sample().tick, tick);
    const std::int64_t passed_ns = rig.sample().time_ns - last_ns;
    ASSERT_GE(passed_ns, 0);
    ASSERT_LE(passed_ns, 100'000'000);
    // The sensor samples at full 0.1 ms, the tick is in between.
    constexpr std::int64_t kSensorNs = 100'000;
    ASSERT_EQ(rig.sample().force_count, rig.sample().time_ns / kSensorNs - last_ns / kSensorNs);
    const bool missing = (rig.sample().status & hal::sample_status::kForceMissing) != 0;
    ASSERT_EQ(missing, rig.sample().force_count == 0) << "a sample too early for the sensor says so";
    last_ns = rig.sample().time_ns;
  }
  EXPECT_GT(last_ns, 0);
}

}  // namespace
}  // namespace hapticd::sim
