// The force sensor by itself: converter, noise, range, bias, averaging.

#include "hal/sim/sensor/nano17.h"

#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <limits>

#include "hal/sim/sensor/sensor_bias.h"
#include "virtual_rig.h"

namespace hapticd::sim {
namespace {

using hal::Vector3;

hal::RigSample mean_of(Nano17& sensor, const Vector3& load_n, int samples) {
  for (int i = 0; i < samples; ++i) sensor.measure(load_n);
  hal::RigSample sample;
  sensor.read(sample);
  return sample;
}

TEST(Nano17, IsTheSensorOfTheDissertation) {
  const Nano17 sensor(0.00935, 1);
  EXPECT_EQ(sensor.info().model, "nano17_si_25");
  EXPECT_EQ(sensor.info().range_n, 35.0);
  EXPECT_EQ(sensor.info().resolution_n, 1.0 / 640.0);
  EXPECT_EQ(sensor.info().sample_rate_hz, 10000.0);
  EXPECT_DOUBLE_EQ(sensor.info().tool_mass_g, 9.35);
}

TEST(Nano17, EachSampleIsACountOfItsConverter) {
  Nano17 sensor(0.0, 2);
  for (int i = 0; i < 1000; ++i) {
    const hal::RigSample sample = mean_of(sensor, {0.01 * i, -0.017 * i, 0.03 * i}, 1);
    for (const double f_n : {sample.sensor_force_n.x, sample.sensor_force_n.y, sample.sensor_force_n.z}) {
      ASSERT_NEAR(640.0 * f_n, std::round(640.0 * f_n), 1e-9);
    }
  }
}

// 10 mN of jitter read as five standard deviations: 2 mN after the mean of ten, of noise and of rounding.
TEST(Nano17, JitterOfTheTenSampleMeanIsTwoMillinewton) {
  Nano17 sensor(0.0, 3);
  constexpr int kMeans = 30'000;
  const Vector3 load_n{1.234, -0.567, 3.21};
  Vector3 sum, square_sum;
  double cross = 0.0, lag = 0.0, last = 0.0;
  for (int i = 0; i < kMeans; ++i) {
    const Vector3 e = mean_of(sensor, load_n, 10).sensor_force_n - load_n;
    sum = sum + e;
    square_sum = square_sum + Vector3{e.x * e.x, e.y * e.y, e.z * e.z};
    cross += e.x * e.z;
    lag += e.x * last;
    last = e.x;
  }
  for (const double s : {square_sum.x, square_sum.y, square_sum.z}) {
    EXPECT_NEAR(std::sqrt(s / kMeans), 2e-3, 0.02 * 2e-3);
  }
  const double error_n = 5.0 * 2e-3 / std::sqrt(kMeans);
  EXPECT_LT(test::length(sum) / kMeans, error_n) << "no offset";
  EXPECT_NEAR(cross / kMeans / 4e-6, 0.0, 5.0 / std::sqrt(kMeans)) << "channels are independent";
  EXPECT_NEAR(lag / kMeans / 4e-6, 0.0, 5.0 / std::sqrt(kMeans)) << "and so are samples";
}

TEST(Nano17, ClipsAtItsRangeAndSaysSo) {
  struct Case {
    Vector3 load_n, reading_n;
  };
  for (const auto& [load_n, reading_n] :
       {Case{{30.0, 0.0, 0.0}, {25.0, 0.0, 0.0}}, Case{{0.0, -26.0, 0.0}, {0.0, -25.0, 0.0}},
        Case{{0.0, 0.0, 36.0}, {0.0, 0.0, 35.0}}, Case{{0.0, 0.0, -1e6}, {0.0, 0.0, -35.0}}}) {
    Nano17 sensor(0.0, 4);
    const hal::RigSample sample = mean_of(sensor, load_n, 10);
    EXPECT_EQ(sample.status, hal::sample_status::kForceSaturated);
    EXPECT_LT(test::length(sample.sensor_force_n - reading_n), 0.02);
    EXPECT_EQ(mean_of(sensor, {}, 10).status, 0U) << "over with the load";
  }
}

TEST(Nano17, OneSaturatedSampleOfTenIsEnough) {
  Nano17 sensor(0.0, 5);
  sensor.measure({0.0, 0.0, 40.0});
  EXPECT_EQ(mean_of(sensor, {0.0, 0.0, 1.0}, 9).status, hal::sample_status::kForceSaturated);
}

TEST(Nano17, BelowItsRangeItIsFit) {
  Nano17 sensor(0.0, 6);
  EXPECT_EQ(mean_of(sensor, {24.9, -24.9, 34.9}, 100).status, 0U);
}

TEST(Nano17, BiasTakesThePresentLoadAsZero) {
  Nano17 sensor(0.0, 7);
  const Vector3 load_n{0.3, -0.2, -1.5};
  const auto take_as_zero = [&sensor](const hal::RigSample& seen) {
    sensor.bias(seen.sensor_force_n, seen.sensor_torque_n_mm);
  };
  take_as_zero(mean_of(sensor, load_n, 10'000));
  EXPECT_LT(test::length(mean_of(sensor, load_n, 10'000).sensor_force_n), 5e-4);
  EXPECT_NEAR(mean_of(sensor, load_n + Vector3{0.0, 0.0, 2.0}, 10'000).sensor_force_n.z, 2.0, 5e-4);
  take_as_zero(mean_of(sensor, {}, 10'000));
  EXPECT_LT(test::length(mean_of(sensor, {}, 10'000).sensor_force_n), 5e-4) << "and again from there";
}

TEST(SensorBias, OneThatWasNotTakenInTimeIsNeverTaken) {
  Nano17 sensor(0.0, 1);
  SensorBias bias;
  EXPECT_FALSE(bias.take(std::chrono::milliseconds(5))) << "no one reads the sensor";
  hal::RigSample sample;
  for (std::int64_t ms = 0; ms < 1000; ++ms) {
    for (int i = 0; i < 10; ++i) sensor.measure({0.0, 0.0, 5.0});
    sensor.read(sample);
    bias.follow(sample, ms * 1'000'000, sensor);
  }
  EXPECT_EQ(sample.bias_serial, 1U);
  EXPECT_NEAR(sample.sensor_force_n.z, 5.0, 0.05) << "the load of later is no zero";
}

TEST(Nano17, RangeIsThatOfTheLoadNotOfTheBiasedReading) {
  Nano17 sensor(0.0, 8);
  sensor.bias_at({0.0, 0.0, 10.0});
  const hal::RigSample sample = mean_of(sensor, {0.0, 0.0, 36.0}, 10);
  EXPECT_EQ(sample.status, hal::sample_status::kForceSaturated);
  EXPECT_NEAR(sample.sensor_force_n.z, 25.0, 1e-9);
}

TEST(Nano17, TorqueIsLeverTimesForce) {
  Nano17 sensor(0.0, 9);
  const hal::RigSample sample = mean_of(sensor, {1.0, 2.0, -3.0}, 10'000);
  const Vector3 lever_mm{0.0, 0.0, -60.0};
  EXPECT_LT(test::length(sample.sensor_torque_n_mm - test::cross(lever_mm, sample.sensor_force_n)), 1e-9);
}

TEST(Nano17, WithoutSamplesTheLastMeanStandsAndIsMarked) {
  Nano17 sensor(0.0, 10);
  const Vector3 last_n = mean_of(sensor, {0.0, 0.0, 5.0}, 10).sensor_force_n;
  hal::RigSample sample;
  sensor.read(sample);
  EXPECT_EQ(sample.status, hal::sample_status::kForceMissing);
  EXPECT_EQ(sample.force_count, 0U);
  EXPECT_EQ(sample.sensor_force_n.z, last_n.z);
}

TEST(Nano17, LoadsThatAreNoNumbersAreNotAveraged) {
  Nano17 sensor(0.0, 11);
  sensor.measure({0.0, 0.0, std::numeric_limits<double>::quiet_NaN()});
  const hal::RigSample sample = mean_of(sensor, {0.0, 0.0, 1.0}, 9);
  EXPECT_EQ(sample.force_count, 9U);
  EXPECT_NEAR(sample.sensor_force_n.z, 1.0, 0.02);
}

}  // namespace
}  // namespace hapticd::sim
