#include "rt/guard/frozen_reading.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <string>

namespace hapticd::rt {
namespace {

constexpr double kSampleS = 1e-3;

/// A sensor that reads 1 N and its noise for half a second, and then the same for two.
struct Case {
  const char* name;
  double noise_n;
  double mm_per_s;      ///< of the tip
  double changes_by_n;  ///< from one sample to the next, after the half second
  std::uint32_t status;
  bool loaded;
  int frozen_after_ticks;  ///< 0: never
};

void PrintTo(const Case& c, std::ostream* out) {
  *out << c.name;
}

hal::RigSample tremble(FrozenReading& reading, double noise_n) {
  std::mt19937_64 random(1);
  std::normal_distribution<double> noise;
  hal::RigSample sample;
  for (int tick = 0; tick < 500; ++tick) {
    // A hand that moves is not noise.
    sample.sensor_force_n.x = 0.1 * std::sin(0.05 * tick) + noise_n * noise(random);
    sample.sensor_force_n.z = 1.0 + noise_n * noise(random);
    EXPECT_FALSE(reading.update(sample, kSampleS, true));
  }
  return sample;
}

int ticks_until_frozen(FrozenReading& reading, const Case& c) {
  hal::RigSample sample = tremble(reading, c.noise_n);
  sample.status = c.status;
  for (int tick = 1; tick <= 2000; ++tick) {
    sample.tip_position_mm.x += c.mm_per_s * kSampleS;
    sample.sensor_force_n.z += c.changes_by_n;
    if (reading.update(sample, kSampleS, c.loaded)) return tick;
  }
  return 0;
}

class Frozen : public testing::TestWithParam<Case> {};

TEST_P(Frozen, IsWhatStaysWhileTheTipMoves) {
  FrozenReading reading;
  EXPECT_EQ(ticks_until_frozen(reading, GetParam()), GetParam().frozen_after_ticks);
}

INSTANTIATE_TEST_SUITE_P(FrozenReading, Frozen,
                         testing::Values(Case{"pressed_at_rest", 0.002, 0.0, 0.0, 0, true, 0},
                                         Case{"free_at_rest", 0.002, 0.0, 0.0, 0, false, 0},
                                         Case{"pressed_and_left_fast", 0.002, 100.0, 0.0, 0, true, 20},
                                         Case{"pressed_and_left_slowly", 0.002, 2.0, 0.0, 0, true, 250},
                                         Case{"waved", 0.002, 100.0, 0.0, 0, false, 1000},
                                         Case{"moved_slowly", 0.002, 4.0, 0.0, 0, false, 0},
                                         Case{"rounded_mean", 0.002, 100.0, 1e-9, 0, true, 20},
                                         Case{"smallest_change_of_a_gauge", 0.002, 100.0, 1.5e-4, 0, true, 0},
                                         Case{"without_noise", 0.0, 100.0, 0.0, 0, true, 0},
                                         Case{"silent", 0.002, 100.0, 0.0, hal::sample_status::kForceMissing,
                                              true, 0}),
                         [](const auto& info) { return std::string(info.param.name); });

TEST(FrozenReading, EndsWithTheFirstReadingThatChanges) {
  FrozenReading reading;
  hal::RigSample sample = tremble(reading, 0.002);
  for (int tick = 0; tick < 30; ++tick) {
    sample.tip_position_mm.x += 0.1;
    reading.update(sample, kSampleS, true);
  }
  EXPECT_TRUE(reading.update(sample, kSampleS, false)) << "the load was forgotten meanwhile, not the freeze";
  sample.sensor_force_n.z = 0.9;
  EXPECT_FALSE(reading.update(sample, kSampleS, true));
}

}  // namespace
}  // namespace hapticd::rt
