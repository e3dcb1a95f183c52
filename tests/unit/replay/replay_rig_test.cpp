// How a recording becomes samples: resampling, gaps, bias, the end, starting over.

#include "hal/replay/replay_rig.h"

#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <vector>

#include "replay_file.h"
#include "tests/unit/allocation_counter.h"

namespace hapticd::replay {
namespace {

using test::ReplayFile;

std::unique_ptr<ReplayRig> open(const ReplayFile& file, ReplayConfig config = {}) {
  config.path = file.path();
  auto rig = ReplayRig::open(config);
  EXPECT_TRUE(rig) << rig.error().text();
  return rig ? std::move(*rig) : nullptr;
}

std::vector<hal::RigSample> all_samples(hal::Rig& rig) {
  std::vector<hal::RigSample> samples;
  while (!rig.exhausted()) rig.read(samples.emplace_back());
  return samples;
}

TEST(ReplayRig, InterpolatesLinearlyAtTheLoopRate) {
  const ReplayFile file("time_s,force_N,depth_mm\n0,0,0\n0.1,1,2\n0.2,0,3\n");
  const auto rig = open(file);
  const auto samples = all_samples(*rig);
  ASSERT_EQ(samples.size(), 201U) << "both ends are played";
  EXPECT_DOUBLE_EQ(samples[50].sensor_force_n.z, 0.5) << "positive when the object pushes back";
  EXPECT_DOUBLE_EQ(samples[50].tip_position_mm.z, -1.0) << "depth goes down";
  EXPECT_DOUBLE_EQ(samples[100].sensor_force_n.z, 1.0);
  EXPECT_DOUBLE_EQ(samples[150].tip_position_mm.z, -2.5);
  EXPECT_DOUBLE_EQ(samples[200].tip_position_mm.z, -3.0);
  for (std::size_t i = 0; i < samples.size(); ++i) {
    EXPECT_EQ(samples[i].tick, i);
    EXPECT_EQ(samples[i].time_ns, static_cast<std::int64_t>(i) * 1'000'000);
    EXPECT_EQ(samples[i].status, 0U);
    EXPECT_EQ(samples[i].force_count, 1U);
    EXPECT_EQ(samples[i].force_age_ns, 0);
  }
}

TEST(ReplayRig, FollowsUnevenStepsAndOtherRates) {
  const ReplayFile file("time_s,force_N,depth_mm\n0,0,0\n0.01,0.01,0\n0.04,0.04,0\n0.05,0.05,0\n");
  const auto rig = open(file, {.rate_hz = 4000.0});
  const auto samples = all_samples(*rig);
  ASSERT_EQ(samples.size(), 201U);
  for (std::size_t i = 0; i < samples.size(); ++i) {
    EXPECT_NEAR(samples[i].sensor_force_n.z, static_cast<double>(i) / 4000.0, 1e-15);
  }
}

TEST(ReplayRig, ShowsAGapAsASilentSensor) {
  const ReplayFile file(
      "time_s,force_N,depth_mm\n0,0.1,0\n0.01,0.1,0\n0.02,0.2,0\n0.03,0.3,0\n0.13,0.9,10\n0.14,0.9,10\n0.15,"
      "0.9,10\n");
  const auto rig = open(file);
  const auto samples = all_samples(*rig);
  ASSERT_EQ(samples.size(), 151U);
  for (std::size_t i = 0; i < samples.size(); ++i) {
    const bool in_gap = i > 30 && i < 130;
    EXPECT_EQ(samples[i].status, in_gap ? hal::sample_status::kForceMissing : 0U) << i;
    EXPECT_NEAR(static_cast<double>(samples[i].force_age_ns),
                in_gap ? 1e6 * static_cast<double>(i - 30) : 0.0, 1.0);
    if (in_gap) {
      EXPECT_DOUBLE_EQ(samples[i].sensor_force_n.z, 0.3) << "the last force is held, none is made up";
      EXPECT_EQ(samples[i].force_count, 0U);
    }
  }
}

// A recording of the daemon on a machine that was busy: a tick came 100 ms late, with a force of that
// instant.
TEST(ReplayRig, TakesALateTickForNoSilentSensor) {
  const ReplayFile file(
      "time_s,force_N,depth_mm,sample_force_age_ms\n0,0.1,0,0.2\n0.01,0.1,0,0.1\n0.02,0.2,0,0.2\n"
      "0.03,0.3,0,0.1\n0.13,0.9,10,0.2\n0.14,0.9,10,0.1\n");
  const auto samples = all_samples(*open(file));
  ASSERT_EQ(samples.size(), 141U);
  for (std::size_t i = 0; i < samples.size(); ++i) {
    EXPECT_EQ(samples[i].status, 0U) << i;
    EXPECT_EQ(samples[i].force_age_ns, 0) << i;
  }
  EXPECT_NEAR(samples[80].sensor_force_n.z, 0.6, 1e-9);
}

// A sensor fell silent, and the loop went on: its rows repeat the last force.
TEST(ReplayRig, ShowsARecordedSilenceAsItWas) {
  const ReplayFile file(
      "time_s,force_N,depth_mm,sample_force_age_ms\n0,0.1,0,0\n0.01,0.3,0,0\n0.02,0.3,0,10\n"
      "0.03,0.3,0,20\n0.04,0.5,0,0\n0.05,0.5,0,0\n");
  const auto samples = all_samples(*open(file));
  ASSERT_EQ(samples.size(), 51U);
  for (std::size_t i = 0; i < samples.size(); ++i) {
    const bool is_silent = i > 10 && i <= 30;
    EXPECT_EQ(samples[i].status, is_silent ? hal::sample_status::kForceMissing : 0U) << i;
    EXPECT_NEAR(static_cast<double>(samples[i].force_age_ns),
                is_silent ? 1e6 * static_cast<double>(i - 10) : 0.0, 1.0)
        << i;
    EXPECT_EQ(samples[i].force_count, is_silent ? 0U : 1U) << i;
  }
}

TEST(ReplayRig, TakesTheFirstSecondsAsZeroForceOnlyWhenAsked) {
  const ReplayFile file("time_s,force_N,depth_mm\n0,0.01,0\n0.1,0.03,0\n0.2,1.02,1\n");
  EXPECT_DOUBLE_EQ(all_samples(*open(file)).front().sensor_force_n.z, 0.01);
  EXPECT_NEAR(all_samples(*open(file, {.bias_s = 0.1})).back().sensor_force_n.z, 1.0, 1e-12);
}

TEST(ReplayRig, EndsAndIsASilentSensorToTheOneWhoGoesOn) {
  const ReplayFile file("time_s,force_N,depth_mm\n0,0,0\n0.01,0.5,1\n");
  const auto rig = open(file);
  EXPECT_DOUBLE_EQ(rig->duration_s(), 0.01);
  EXPECT_EQ(all_samples(*rig).size(), 11U);
  hal::RigSample sample;
  for (int i = 1; i <= 5; ++i) {
    rig->read(sample);
    EXPECT_EQ(sample.status, hal::sample_status::kForceMissing);
    EXPECT_NEAR(static_cast<double>(sample.force_age_ns), 1e6 * i, 1.0);
    EXPECT_DOUBLE_EQ(sample.sensor_force_n.z, 0.5);
    EXPECT_DOUBLE_EQ(sample.tip_position_mm.z, -1.0);
  }
}

TEST(ReplayRig, StartsOverWithTheToolFreeInBetween) {
  const ReplayFile file("time_s,force_N,depth_mm\n0,0.25,1\n0.01,0.5,3\n");
  const auto rig = open(file, {.loop = true});
  constexpr std::size_t kPass = 11;
  constexpr std::size_t kPause = 500;
  std::vector<hal::RigSample> samples(3 * (kPass + kPause));
  for (auto& sample : samples) rig->read(sample);
  EXPECT_FALSE(rig->exhausted());
  for (std::size_t i = 0; i < samples.size(); ++i) {
    const std::size_t in_pass = i % (kPass + kPause);
    EXPECT_EQ(samples[i].tick, i) << "time goes on";
    EXPECT_EQ(samples[i].status, 0U);
    if (in_pass < kPass) {
      EXPECT_NEAR(samples[i].sensor_force_n.z, 0.25 + 0.025 * static_cast<double>(in_pass), 1e-12);
    } else {
      EXPECT_DOUBLE_EQ(samples[i].sensor_force_n.z, 0.0);
    }
    if (i > 0) {
      EXPECT_LT(std::abs(samples[i].tip_position_mm.z - samples[i - 1].tip_position_mm.z), 0.21)
          << "no jump at " << i;
    }
  }
}

TEST(ReplayRig, SaysWhatItIs) {
  const ReplayFile file("time_s,force_N,depth_mm\n0,0,0\n0.1,-2,1\n0.2,1,1\n");
  const auto rig = open(file);
  const hal::RigInfo& info = rig->info();
  EXPECT_EQ(info.kind, hal::RigKind::kReplay);
  EXPECT_EQ(info.name.rfind("replay:", 0), 0U);
  EXPECT_FALSE(info.renders_force);
  EXPECT_FALSE(info.has_truth);
  EXPECT_EQ(info.device.model, "recording");
  EXPECT_DOUBLE_EQ(info.device.max_force_n, 8.5);
  EXPECT_DOUBLE_EQ(info.sensor.range_n, 2.0);
  EXPECT_NEAR(info.sensor.sample_rate_hz, 10.0, 1e-9);
  EXPECT_TRUE(rig->owns_clock());
  EXPECT_FALSE(open(file, {.as_fast_as_possible = false})->owns_clock()) << "paced by the loop";
}

TEST(ReplayRig, ReadsWithoutAllocating) {
  const ReplayFile file("time_s,force_N,depth_mm\n0,0,0\n0.1,1,2\n0.9,0,3\n");
  const auto rig = open(file, {.loop = true});
  hal::RigSample sample;
  const long before = test::allocations();
  for (int i = 0; i < 5000; ++i) rig->read(sample);
  EXPECT_EQ(test::allocations(), before);
}

}  // namespace
}  // namespace hapticd::replay
