// ε_f from free motion: residuals of known size.

#include "server/identification/session/threshold_identification.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "identified.h"

namespace hapticd::identification {
namespace {

using namespace test;

using hal::Vector3;

hal::RigInfo threshold_rig() {
  hal::RigInfo info;
  info.sensor.tool_mass_g = 10.0;
  return info;
}

/// A tool that is exactly what the rig says, waved at up to `speed`, with a force of `extra` next to it.
rt::Observation free_sample(double t, double speed_mm_per_s, double extra_n, double tilt_rad = 0.0) {
  rt::Observation o;
  o.sample.time_ns = std::llround(1e9 * t) + 1'000'000;
  const double w = 9.0;
  o.sample.tip_position_mm = {speed_mm_per_s / w * std::sin(w * t), 0.0, 100.0};
  const double a = -speed_mm_per_s * w * std::sin(w * (t - 5e-4));
  o.sample.tip_orientation = {std::cos(0.5 * tilt_rad), 0.0, std::sin(0.5 * tilt_rad), 0.0};
  // Tool frame; the sensor was biased upright.
  const double c = std::cos(tilt_rad), s = std::sin(tilt_rad);
  const double weight = 9807e-6 * 10.0, inertia = -1e-5 * a;
  o.sample.sensor_force_n = {c * inertia + s * weight, 0.0, s * inertia - c * weight + weight + extra_n};
  return o;
}

/// Rest, slow, fast and tilted, with residuals of ± `size`; the time counts from `from_s` on.
void run(Identification& identification, double seconds, double size_n, double from_s = 0.0) {
  for (int i = 0; i < static_cast<int>(1e3 * seconds); ++i) {
    const double t = 1e-3 * i;
    const int part = static_cast<int>(t / 6.0) % 4;
    const double speed = part == 0 ? 0.0 : part == 2 ? 290.0 : 150.0;
    if (i % 6000 < 20) continue;  // from one motion to the next: a gap
    // Held for half a second each, so that the filter has nothing to take away.
    const double extra =
        size_n * ((i / 500) % 2 == 0 ? 1.0 : -1.0) * (0.8 + 0.2 * std::sin(0.37 * (i / 1000)));
    rt::Observation sample = free_sample(t, speed, extra, part == 3 ? 0.5 : 0.0);
    sample.sample.time_ns += std::llround(1e9 * from_s);
    identification.add(sample);
  }
}

TEST(ThresholdIdentification, LiesAboveTheLargestResidualAndSaysByHowMuch) {
  ThresholdIdentification identification({.duration_s = 20.0}, threshold_rig());
  run(identification, 50.0, 0.02);
  const auto model = value_of(identification.finish());
  const auto& threshold = std::get<rt::ThresholdModel>(model.content);
  EXPECT_GT(threshold.largest_residual_n, 0.017);
  EXPECT_LT(threshold.largest_residual_n, 0.05);
  EXPECT_GE(threshold.threshold_n, threshold.largest_residual_n);
  EXPECT_GT(threshold.observed_s, 46.0);
  EXPECT_NE(model.procedure.find("margin"), std::string::npos);
  EXPECT_EQ(model.parameters.front().name, "threshold_n");
}

TEST(ThresholdIdentification, WaitsUntilTheToolIsFree) {
  ThresholdIdentification unpressed({.duration_s = 20.0}, threshold_rig());
  run(unpressed, 50.0, 0.02);
  ThresholdIdentification pressed({.duration_s = 20.0}, threshold_rig());
  for (int i = 0; i < 2000; ++i) pressed.add(free_sample(1e-3 * i, 0.0, 3.0));
  IdentificationProgress waiting = pressed.progress();
  ASSERT_FALSE(waiting.missing.empty());
  EXPECT_NE(waiting.missing.front().find("take the tool off"), std::string::npos) << waiting.missing.front();
  EXPECT_NE(pressed.next_request().words.find("take the tool off"), std::string::npos);
  EXPECT_EQ(waiting.samples, 0U);
  EXPECT_TRUE(holds(refusal_of(pressed).what, "not free"));
  for (int i = 0; i < 100; ++i) pressed.add(free_sample(2.0 + 1e-3 * i, 0.0, 3.0 - 0.03 * i));
  run(pressed, 50.0, 0.02, 2.1);
  EXPECT_EQ(pressed.next_request().words.find("take the tool off"), std::string::npos);
  const auto with = pressed.finish();
  const auto without = unpressed.finish();
  ASSERT_TRUE(with) << with.error().text();
  ASSERT_TRUE(without);
  const double threshold_n = std::get<rt::ThresholdModel>(without->content).threshold_n;
  EXPECT_NEAR(std::get<rt::ThresholdModel>(with->content).threshold_n, threshold_n, 0.05 * threshold_n);
  EXPECT_FALSE(has_remark(pressed, "touched"));
}

TEST(ThresholdIdentification, AnExponentialTailIsExtrapolatedAsItIs) {
  // Greatest residuals of a second, exponential beyond 10 mN with a scale of 3 mN.
  ThresholdIdentification identification({}, threshold_rig());
  std::uint32_t seed = 3;
  double size = 0.0;
  constexpr int kSeconds = 30;
  for (int i = 0; i < 1000 * kSeconds; ++i) {
    if (i % 1000 == 0) {
      seed = seed * 1664525U + 1013904223U;
      size = 0.010 - 0.003 * std::log((seed + 1.0) / 4294967297.0);
    }
    // A slow bump in the middle of each second: the filter leaves it as it is.
    const double phase = (i % 1000) / 1000.0;
    identification.add(free_sample(1e-3 * i, 0.0, size * std::pow(std::sin(3.14159265 * phase), 2.0)));
  }
  const auto model = identification.finish();
  ASSERT_TRUE(model);
  const double expected = 0.010 + 0.003 * std::log(ThresholdIdentification::kAlarmFreeS);
  const auto& threshold = std::get<rt::ThresholdModel>(model->content);
  EXPECT_NEAR(threshold.threshold_n, expected, 0.2 * expected);
  EXPECT_GT(threshold.threshold_n, 1.1 * threshold.largest_residual_n) << "for what was not seen";
}

TEST(ThresholdIdentification, WantsMotionThatItHasNotSeen) {
  ThresholdIdentification identification({}, threshold_rig());
  for (int i = 0; i < 25'000; ++i) identification.add(free_sample(1e-3 * i, 0.0, 1e-3 * std::sin(0.1 * i)));
  const IdentificationProgress progress = identification.progress();
  EXPECT_FALSE(progress.converged);
  EXPECT_EQ(progress.missing.size(), 3U) << "motion, strikes, tilt";
  EXPECT_LT(progress.coverage.front().share, 0.5);
}

TEST(ThresholdIdentification, AcceptsFastMotionOfAToolHeldAtAnyOrientation) {
  ThresholdIdentification identification({}, threshold_rig());
  const auto missing_with = [&](double tilt_rad) {
    static int i = 0;
    for (int n = 0; n < 2000; ++n, ++i) {
      rt::Observation sample = free_sample(1e-3 * i, 0.0, 1e-3 * std::sin(0.1 * i));
      sample.sample.tip_orientation = {std::cos(0.5 * tilt_rad), std::sin(0.5 * tilt_rad), 0.0, 0.0};
      sample.sample.tip_position_mm.x += 30.0 * std::sin(8.0 * 1e-3 * i);  // up to 240 mm/s
      identification.add(sample);
    }
    std::string all;
    for (const std::string& one : identification.progress().missing) all += one + "; ";
    return all;
  };
  const std::string lying = missing_with(1.5);
  EXPECT_EQ(lying.find("strike"), std::string::npos) << lying;
  EXPECT_NE(lying.find("turned by more than 20°"), std::string::npos) << "it was never turned: " << lying;
  const std::string turned = missing_with(1.0);
  EXPECT_EQ(turned.find("turned"), std::string::npos) << turned;
}

TEST(ThresholdIdentification, ATouchStandsAlone) {
  ThresholdIdentification identification({.duration_s = 10.0}, threshold_rig());
  for (int i = 0; i < 40'000; ++i) {
    const double extra = i > 30'000 && i < 30'200 ? 0.8 : 1e-3 * std::sin(0.02 * i);
    identification.add(free_sample(1e-3 * i, 0.0, extra));
  }
  EXPECT_FALSE(identification.progress().converged);
  EXPECT_TRUE(has_remark(identification, "touched"));
}

TEST(ThresholdIdentification, ShortAndDeadSignalsAreRefused) {
  ThresholdIdentification nothing({}, threshold_rig());
  EXPECT_FALSE(nothing.finish());
  ThresholdIdentification few({}, threshold_rig());
  for (int i = 0; i < 10; ++i) few.add(free_sample(1e-3 * i, 0.0, 0.0));
  EXPECT_FALSE(few.finish());
  ThresholdIdentification dead({}, threshold_rig());
  for (int i = 0; i < 20'000; ++i) dead.add(free_sample(1e-3 * i, 0.0, 0.0));
  const auto model = dead.finish();
  EXPECT_FALSE(model);
}

TEST(ThresholdIdentification, TicksWithoutAFreshForceAreBridged) {
  // A box that shares its machine: every eighth tick finds nothing new, and the next one the mean of two.
  ThresholdIdentification identification({}, threshold_rig());
  for (int i = 0; i < 30'000; ++i) {
    const double t = 1e-3 * i;
    rt::Observation o = free_sample(t, 100.0, 1e-3 * std::sin(0.3 * i));
    if (i % 8 == 1) o.sample.status = hal::sample_status::kForceMissing;
    if (i % 8 == 2) {
      o.sample.sensor_force_n = free_sample(t - 5e-4, 100.0, 0.0).sample.sensor_force_n;
    }
    identification.add(o);
  }
  const auto model = value_of(identification.finish());
  const auto& threshold = std::get<rt::ThresholdModel>(model.content);
  EXPECT_GT(threshold.observed_s, 29.0);
  EXPECT_LT(threshold.threshold_n, 0.02);
}

TEST(ThresholdIdentification, GapsAndNaNStartItAgain) {
  ThresholdIdentification identification({}, threshold_rig());
  for (int i = 0; i < 30'000; ++i) {
    rt::Observation o = free_sample(1e-3 * i, 100.0, 1e-3 * std::sin(0.3 * i));
    if (i % 3000 == 0) o.sample.sensor_force_n.y = std::numeric_limits<double>::quiet_NaN();
    if (i % 5000 == 1) o.sample.status = hal::sample_status::kForceSaturated;
    if (i % 7000 < 100) continue;
    identification.add(o);
  }
  const auto model = value_of(identification.finish());
  EXPECT_LT(std::get<rt::ThresholdModel>(model.content).threshold_n, 0.02);
  EXPECT_EQ(identification.progress().remarks.size(), 3U);
}

}  // namespace
}  // namespace hapticd::identification
