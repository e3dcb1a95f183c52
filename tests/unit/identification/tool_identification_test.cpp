// The tool from free motion: a rigid body turned and waved along closed forms.

#include "server/identification/session/tool_identification.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "identified.h"
#include "rt/signal/vector.h"
#include "tests/support/value_of.h"

namespace hapticd::identification {
namespace {

using namespace test;

using hal::Quaternion;
using hal::Vector3;

struct Body {
  double mass_g = 12.0;
  Vector3 centre_mm{2.0, -3.0, -18.0};
  Vector3 arm_mm{2.0, -3.0, 42.0};
  Vector3 force_bias_n{0.1, -0.2, 0.3};
  Vector3 torque_bias_n_mm{1.0, 2.0, -3.0};
  Quaternion sensor_to_tool{};
};

Quaternion turned(const Vector3& rad) {
  const double angle = rt::norm(rad);
  if (angle == 0.0) return {};
  const Vector3 n = rad * (std::sin(0.5 * angle) / angle);
  return {std::cos(0.5 * angle), n.x, n.y, n.z};
}

struct Motion {
  double tilt_rad = 0.7;
  double wave_mm = 20.0;

  Quaternion orientation(double t) const {
    return turned({tilt_rad * std::sin(2.3 * t), tilt_rad * std::sin(2.9 * t + 1.0),
                   0.2 * tilt_rad * std::sin(1.7 * t)});
  }
  Vector3 position(double t) const {
    return Vector3{std::sin(7.5 * t), std::sin(9.8 * t), 0.6 * std::sin(5.8 * t)} * wave_mm;
  }
};

/// The sample of a body at a time, from differences fine enough to be exact.
rt::Observation sample_at(const Body& body, const Motion& motion, double t, double period_s) {
  const auto centre = [&](double at) {
    return motion.position(at) + rt::rotated(motion.orientation(at), body.arm_mm);
  };
  constexpr double h = 1e-3;
  const auto load = [&](double at) {
    const Vector3 a = (centre(at + h) - centre(at) * 2.0 + centre(at - h)) * (1.0 / (h * h));
    return rt::rotated(rt::conjugate(motion.orientation(at)), Vector3{0.0, 0.0, -9807.0} - a) *
           (1e-6 * body.mass_g);
  };
  rt::Observation o;
  o.sample.time_ns = std::llround(1e9 * t);
  o.sample.tip_position_mm = motion.position(t);
  o.sample.tip_orientation = motion.orientation(t);
  o.sample.force_count = 10;
  // The sensor's value is the mean since the tick before.
  const Vector3 tool = load(t - 0.5 * period_s);
  const Quaternion back = rt::conjugate(body.sensor_to_tool);
  o.sample.sensor_force_n = rt::rotated(back, tool) + body.force_bias_n;
  o.sample.sensor_torque_n_mm = rt::rotated(back, rt::cross(body.centre_mm, tool)) + body.torque_bias_n_mm;
  return o;
}

hal::RigInfo rig_at(double rate_hz) {
  hal::RigInfo rig;
  rig.rate_hz = rate_hz;
  return rig;
}

void run(Identification& identification, const Body& body, const Motion& motion, double seconds,
         double from_s = 0.0) {
  for (int i = 0; i < static_cast<int>(1e3 * seconds); ++i) {
    identification.add(sample_at(body, motion, from_s + 1e-3 * i, 1e-3));
  }
}

class TurnedSensor : public testing::TestWithParam<double> {};
INSTANTIATE_TEST_SUITE_P(Angles, TurnedSensor, testing::Values(0.0, 0.7, 1.5707963, 3.0));

TEST_P(TurnedSensor, EverythingIsFound) {
  Body body{.sensor_to_tool = turned(Vector3{0.6, 0.0, 0.8} * GetParam())};
  ToolIdentification identification({}, rig_at(1000.0));
  run(identification, body, {}, 10.0);
  const auto model = value_of(identification.finish());
  EXPECT_TRUE(model.converged);
  const auto& tool = std::get<rt::ToolModel>(model.content);
  EXPECT_NEAR(tool.mass_g, body.mass_g, 0.002 * body.mass_g);
  EXPECT_LT(rt::norm(tool.centre_mm - body.centre_mm), 0.05);
  ASSERT_TRUE(tool.tip_to_centre_mm);
  EXPECT_LT(rt::norm(*tool.tip_to_centre_mm - body.arm_mm), 1.0);
  EXPECT_LT(rt::norm(tool.force_bias_n - body.force_bias_n), 5e-4);
  EXPECT_LT(rt::norm(tool.torque_bias_n_mm - body.torque_bias_n_mm), 0.02);
  const Quaternion& q = tool.sensor_to_tool;
  const Quaternion& p = body.sensor_to_tool;
  EXPECT_GT(std::abs(q.w * p.w + q.x * p.x + q.y * p.y + q.z * p.z), 1.0 - 1e-5);
  EXPECT_EQ(identification.next_request().motion, MotionRequest::Motion::kRest);
}

TEST(ToolIdentification, StandingStillSaysNoMass) {
  ToolIdentification identification({}, rig_at(1000.0));
  run(identification, {}, {0.0, 0.0}, 5.0);
  EXPECT_TRUE(holds(refusal_of(identification).limit, "gravity from several directions"));
  const std::vector<std::string> missing = identification.progress().missing;
  EXPECT_TRUE(std::ranges::any_of(missing, [](const std::string& words) {
    return words.find("tilt the tool 30° about y") != std::string::npos;
  }));
  EXPECT_TRUE(std::ranges::any_of(missing, [](const std::string& words) {
    return words.ends_with("mass not yet known, centre not yet known");
  }));
  for (const char* name : {"sensor_to_tool_x_rad", "sensor_to_tool_y_rad", "sensor_to_tool_z_rad"}) {
    EXPECT_NEAR(parameter(identification.progress().parameters, name).value, 0.0, 0.01)
        << "what the data do not show stays as it was given";
  }
}

TEST(ToolIdentification, UprightWavesTellTheMassButNotTheBiasAlongGravity) {
  // Waved along x only: mass yes; the bias along z cannot be distinguished from the weight as long as the
  // seat of the sensor is open, nor can the turn about x.
  struct AlongX {
    static rt::Observation at(double t) {
      rt::Observation o;
      o.sample.time_ns = std::llround(1e9 * t);
      const double a = -20.0 * 81.0 * std::sin(9.0 * (t - 5e-4));
      o.sample.tip_position_mm = {20.0 * std::sin(9.0 * t), 0.0, 0.0};
      o.sample.sensor_force_n = Vector3{-a, 0.0, -9807.0} * 12e-6;
      o.sample.force_count = 10;
      return o;
    }
  };
  ToolIdentification identification({}, rig_at(1000.0));
  for (int i = 0; i < 6000; ++i) identification.add(AlongX::at(1e-3 * i));
  const auto model = value_of(identification.finish());
  EXPECT_FALSE(model.converged);
  EXPECT_NEAR(std::get<rt::ToolModel>(model.content).mass_g, 12.0, 0.05);
  EXPECT_FALSE(std::get<rt::ToolModel>(model.content).tip_to_centre_mm) << "it was never turned";
  EXPECT_TRUE(std::isinf(parameter(model, "sensor_to_tool_x_rad").standard_error));
  EXPECT_TRUE(std::isinf(parameter(model, "centre_x_mm").standard_error)) << "no torque came";
  EXPECT_TRUE(std::isinf(parameter(model, "tip_to_centre_z_mm").standard_error)) << "nothing turned";
}

TEST(ToolIdentification, SecondsOfContactAreLeftOut) {
  const Body body;
  ToolIdentification identification({}, rig_at(1000.0));
  for (int i = 0; i < 14000; ++i) {
    rt::Observation o = sample_at(body, {}, 1e-3 * i, 1e-3);
    if (i > 6000 && i < 7500) o.sample.sensor_force_n.z += 2.0 * std::sin(1e-2 * i);
    identification.add(o);
  }
  const auto model = value_of(identification.finish());
  EXPECT_NEAR(std::get<rt::ToolModel>(model.content).mass_g, body.mass_g, 0.01 * body.mass_g);
  EXPECT_TRUE(has_remark(identification, "touched"));
}

TEST(ToolIdentification, BadSamplesAreCountedAndDoNoHarm) {
  const Body body;
  ToolIdentification identification({}, rig_at(1000.0));
  for (int i = 0; i < 12000; ++i) {
    rt::Observation o = sample_at(body, {}, 1e-3 * i, 1e-3);
    if (i == 2000) o.sample.sensor_force_n.x = std::numeric_limits<double>::quiet_NaN();
    if (i == 4000) o.sample.tip_orientation = {0.0, 0.0, 0.0, 0.0};
    if (i == 6000) o.sample.status = hal::sample_status::kForceSaturated;
    if (i >= 8000 && i < 8300) continue;  // a gap
    identification.add(o);
  }
  const auto model = value_of(identification.finish());
  EXPECT_NEAR(std::get<rt::ToolModel>(model.content).mass_g, body.mass_g, 0.002 * body.mass_g);
  EXPECT_EQ(identification.progress().remarks.size(), 3U) << "unfit, saturated, gap";
}

TEST(ToolIdentification, ReversedSignAndTenSamplesAreRefused) {
  ToolIdentification few({}, rig_at(1000.0));
  for (int i = 0; i < 10; ++i) few.add(sample_at({}, {}, 1e-3 * i, 1e-3));
  EXPECT_FALSE(few.finish());

  // A reversed sensor is a sensor turned inside out: no rotation does that.
  ToolIdentification reversed({}, rig_at(1000.0));
  for (int i = 0; i < 8000; ++i) {
    rt::Observation o = sample_at({}, {}, 1e-3 * i, 1e-3);
    o.sample.sensor_force_n = o.sample.sensor_force_n * -1.0;
    reversed.add(o);
  }
  const auto model = reversed.finish();
  EXPECT_TRUE(!model || !model->converged || model->residual > 0.1);
}

TEST(ToolIdentification, MemoryStaysWhatItIs) {
  ToolIdentification identification({}, rig_at(1000.0));
  // Blocks are joined in pairs once they are full: ten minutes of a tenth of the rate, cheaply.
  const Body body;
  const Motion motion;
  for (int i = 0; i < 300'000; ++i) {
    if (i % 3 == 0) continue;
    rt::Observation o = sample_at(body, motion, 1e-3 * (i % 40'000), 1e-3);
    o.sample.time_ns = 1'000'000LL * i;
    if (i % 40'000 < 400) o.sample.status = hal::sample_status::kForceMissing;  // the motion jumps there
    identification.add(o);
  }
  const auto model = value_of(identification.finish());
  EXPECT_NEAR(std::get<rt::ToolModel>(model.content).mass_g, body.mass_g, 0.02 * body.mass_g);
}

TEST(ToolLoadFit, StandardErrorsAreThoseOfTheNoise) {
  // White noise of known size on the force of many static orientations: mass scatters by its standard error.
  double square = 0.0, reported = 0.0;
  constexpr int kRuns = 40;
  std::uint32_t seed = 7;
  const auto noise = [&] {
    double sum = 0.0;
    for (int i = 0; i < 12; ++i) {
      seed = seed * 1664525U + 1013904223U;
      sum += seed / 4294967296.0;
    }
    return sum - 6.0;
  };
  for (int run = 0; run < kRuns; ++run) {
    ToolMoments moments;
    for (int i = 0; i < 300; ++i) {
      ToolExcitation e;
      const Vector3 g =
          rt::rotated(rt::conjugate(turned({0.7 * std::sin(0.3 * i), 0.7 * std::cos(0.17 * i), 0.0})),
                      Vector3{0.0, 0.0, -9807e-6});
      e.weight_n_per_g = g;
      e.force_n = g * 10.0 + Vector3{noise(), noise(), noise()} * 2e-3;
      moments.add(e);
    }
    const ToolLoadFit fit = fit_tool_load(moments);
    ASSERT_TRUE(fit.good);
    square += (fit.mass_g - 10.0) * (fit.mass_g - 10.0);
    reported += fit.mass_error_g * fit.mass_error_g;
  }
  EXPECT_NEAR(std::sqrt(square / reported), 1.0, 0.35);
}

TEST(ToolLoadFit, StretchesAboutTheirMeansLeaveADriftOut) {
  const Vector3 bias_n{0.1, -0.05, 0.2};
  ToolMoments stretches, stretch, plain;
  double drift_n = 0.0;
  for (int i = 0; i < 3000; ++i) {
    drift_n += i < 1700 ? 3e-5 : -2e-5;  // up and down again
    ToolExcitation e;
    // Turned further and further, so that the drift looks like a part of the weight.
    e.weight_n_per_g = rt::rotated(rt::conjugate(turned({0.0002 * i, 0.7 * std::cos(0.17 * i), 0.0})),
                                   Vector3{0.0, 0.0, -9807e-6});
    e.force_n = e.weight_n_per_g * 9.35 + bias_n + Vector3{1.0, -2.0, 1.5} * drift_n;
    plain.add(e);
    stretch.add(e);
    if (i % 300 != 299) continue;
    stretches.add(i == 2999 ? stretch : stretch.centred());
    stretch = {};
  }
  const ToolLoadFit fit = fit_tool_load(stretches);
  ASSERT_TRUE(fit.good);
  EXPECT_NEAR(fit.mass_g, 9.35, 0.05) << "what drifts within three seconds is left";
  EXPECT_NEAR(fit.force_bias_n.z, bias_n.z + 1.5 * drift_n, 0.01) << "as it is at the end";
  EXPECT_GT(std::abs(fit_tool_load(plain).mass_g - 9.35), 0.25) << "of all in one it is part of the mass";
}

TEST(ToolLoadFit, EmptyAndAbsurdSumsAreNotGood) {
  EXPECT_FALSE(fit_tool_load({}).good);
  ToolMoments moments;
  ToolExcitation e;
  e.force_n.x = std::numeric_limits<double>::infinity();
  for (int i = 0; i < 20; ++i) moments.add(e);
  EXPECT_FALSE(fit_tool_load(moments).good);
}

}  // namespace
}  // namespace hapticd::identification
