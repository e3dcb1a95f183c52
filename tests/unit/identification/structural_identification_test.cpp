// Structural stiffness from pressed walls: synthetic devices whose bend is known in closed form.

#include "server/identification/session/structural_identification.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <random>
#include <string>

#include "identified.h"
#include "tests/support/texts.h"
#include "tests/support/value_of.h"

namespace hapticd::identification {
namespace {

using namespace test;

using hal::Vector3;

hal::RigInfo high_force() {
  hal::RigInfo rig;
  rig.device.model = "phantom_1_5_high_force";
  rig.device.max_force_n = 37.5;
  rig.rate_hz = 1000.0;
  return rig;
}

/// A device of compliance c(p) with dry friction, seen by encoders and from outside; presses walls as
/// requested.
struct StructuralBench {
  std::function<double(const Vector3&)> compliance_mm_per_n;
  double friction_n = 0.0;
  double sign = 1.0;  ///< of the bend
  bool watched = true;
  std::int64_t time_ns = 0;
  double continuous_n = 0.0;  ///< of the motors; 0: they never warm
  double heat = 0.0, hottest = 0.0;

  rt::Observation at(const Vector3& encoder_mm, double force_n, double speed_mm_per_s) {
    rt::Observation o;
    time_ns += 1'000'000;
    if (continuous_n > 0.0) {
      const double end = force_n * force_n / (continuous_n * continuous_n);
      heat = end + (heat - end) * std::exp(-1e-3 / 12.0);
      hottest = std::max(hottest, heat);
    }
    o.sample.time_ns = time_ns;
    o.sample.tip_position_mm = encoder_mm;
    o.device_command_n = {0.0, 0.0, force_n};
    const double along = force_n - friction_n * (speed_mm_per_s > 0.0   ? 1.0
                                                 : speed_mm_per_s < 0.0 ? -1.0
                                                                        : 0.0);
    o.external_position_mm = encoder_mm - Vector3{0.0, 0.0, sign * compliance_mm_per_n(encoder_mm) * along};
    o.has_external_position = watched;
    return o;
  }

  /// Down to `depth_mm` into a wall at `place` and up again, at an even 30 mm/s, from 5 mm above it.
  void press(Identification& identification, const Vector3& place, double stiffness, double force_n) {
    const double depth_mm = force_n / stiffness;
    for (int way = 0; way < 2; ++way) {
      const double speed = way == 0 ? -30.0 : 30.0;
      const int ticks = static_cast<int>((depth_mm + 5.0) / 0.03);
      for (int i = 0; i <= ticks; ++i) {
        const double done = 0.03 * i;
        const double z = way == 0 ? 5.0 - done : -depth_mm + done;
        identification.add(at(place + Vector3{0.0, 0.0, z}, z < 0.0 ? -stiffness * z : 0.0, speed));
      }
    }
    for (int i = 0; i < 200; ++i) identification.add(at(place + Vector3{0.0, 0.0, 5.0}, 0.0, 0.0));
  }

  void follow(Identification& identification, int presses) {
    for (int i = 0; i < presses; ++i) {
      const MotionRequest request = identification.next_request();
      if (request.motion != MotionRequest::Motion::kPress) return;
      press(identification, request.place_mm, request.stiffness_n_per_mm, request.force_n);
    }
  }
};

TEST(StructuralIdentification, FindsAConstantStiffnessAndTheDryFrictionOfTheMotors) {
  for (const double friction_n : {0.0, 0.2}) {
    StructuralIdentification identification({.constant = true}, high_force());
    StructuralBench bench{[](const Vector3&) { return 1.0 / 2.537; }, friction_n};
    bench.follow(identification, 8);
    const auto model = value_of(identification.finish());
    EXPECT_TRUE(model.converged);
    const auto& structure = std::get<rt::StructuralModel>(model.content);
    EXPECT_NEAR(structure.stiffness_n_per_mm, 2.537, friction_n == 0.0 ? 1e-6 : 1e-4);
    EXPECT_NEAR(parameter(model, "back_drive_friction_n").value, friction_n, 1e-3);
    EXPECT_EQ(structure.gradient_per_mm.x, 0.0);
    EXPECT_LT(model.residual, 1e-4);
    EXPECT_EQ(identification.next_request().motion, MotionRequest::Motion::kRest) << "nothing more is wanted";
  }
}

TEST(StructuralIdentification, FindsAQuadraticField) {
  const Vector3 centre{0.0, 0.0, 70.0};
  const auto c = [&](const Vector3& p) {
    const Vector3 q = p - centre;
    return 0.4 * (1.0 + 1e-3 * q.x - 5e-4 * q.y + 8e-4 * q.z + 4e-6 * q.x * q.x + 6e-6 * q.z * q.z +
                  2.0 * (2e-6 * q.x * q.y - 1e-6 * q.y * q.z));
  };
  StructuralIdentification identification({}, high_force());
  StructuralBench bench{c};
  bench.follow(identification, 30);
  const auto model = value_of(identification.finish());
  EXPECT_TRUE(model.converged);
  const auto& structure = std::get<rt::StructuralModel>(model.content);
  for (const Vector3& p :
       {Vector3{0.0, 0.0, 70.0}, Vector3{70.0, -40.0, 100.0}, Vector3{-80.0, 50.0, 40.0}}) {
    EXPECT_NEAR(structure.stiffness_at(p) * c(p), 1.0, 1e-4);
  }
}

TEST(StructuralIdentification, AConstantModelOfAFieldSaysSo) {
  StructuralIdentification identification({.constant = true}, high_force());
  StructuralBench bench{[](const Vector3& p) { return 0.4 * (1.0 + 2e-3 * p.x); }};
  bench.follow(identification, 10);
  EXPECT_TRUE(has_remark(identification, "ask for a field"));
}

TEST(StructuralIdentification, OnePressSaysNoField) {
  StructuralIdentification identification({}, high_force());
  StructuralBench bench{[](const Vector3&) { return 0.4; }};
  bench.follow(identification, 1);
  const auto model = value_of(identification.finish());
  EXPECT_FALSE(model.converged);
  EXPECT_EQ(std::get<rt::StructuralModel>(model.content).curvature_per_mm2[0], 0.0);
  EXPECT_FALSE(identification.progress().missing.empty());
}

/// A light device whose motors bear 1.4 N for ever.
hal::RigInfo light(hal::RigKind kind) {
  hal::RigInfo rig;
  rig.kind = kind;
  rig.device.model = "phantom_1_0";
  rig.device.max_force_n = 8.5;
  rig.device.max_continuous_force_n = 1.4;
  rig.rate_hz = 1000.0;
  return rig;
}

TEST(StructuralIdentification, MotorsOfHardwareCoolBetweenPresses) {
  for (const hal::RigKind kind : {hal::RigKind::kHardware, hal::RigKind::kSimulated}) {
    const bool hardware = kind == hal::RigKind::kHardware;
    StructuralIdentification identification({.constant = true}, light(kind));
    StructuralBench bench{[](const Vector3&) { return 0.4; }};
    bench.continuous_n = 1.4;
    int rests = 0;
    for (int i = 0; i < 300 && !identification.progress().converged; ++i) {
      const MotionRequest request = identification.next_request();
      if (request.motion == MotionRequest::Motion::kPress) {
        EXPECT_NEAR(request.force_n, hardware ? 3.0 * 1.4 : 0.8 * 8.5, 1e-9);
        bench.press(identification, request.place_mm, request.stiffness_n_per_mm, request.force_n);
        continue;
      }
      ASSERT_EQ(request.device, MotionRequest::Device::kNothing);
      ASSERT_GT(request.hold_s, 0.0) << "a rest, not the end";
      ++rests;
      for (int tick = 0; tick < static_cast<int>(1e3 * request.hold_s); ++tick) {
        identification.add(bench.at({0.0, 0.0, 75.0}, 0.0, 0.0));
      }
    }
    const auto model = value_of(identification.finish());
    EXPECT_TRUE(model.converged);
    EXPECT_NEAR(std::get<rt::StructuralModel>(model.content).stiffness_n_per_mm, 2.5, 1e-4);
    if (hardware) {
      EXPECT_GT(rests, 0);
      EXPECT_LT(bench.hottest, 0.8) << "where a device warns";
    } else {
      EXPECT_EQ(rests, 0) << "a simulated winding is no one's";
    }
  }
}

TEST(StructuralIdentification, MotorsWarmWhetherOrNotTheInstrumentAnswers) {
  StructuralIdentification identification({.constant = true}, light(hal::RigKind::kHardware));
  StructuralBench bench{[](const Vector3&) { return 0.4; }};
  bench.watched = false;
  EXPECT_EQ(identification.next_request().words.find("cool"), std::string::npos);
  for (int i = 0; i < 3; ++i) bench.press(identification, {0.0, 0.0, 70.0}, 0.5, 4.0);
  EXPECT_TRUE(holds(identification.next_request().words, "cool"));
  EXPECT_EQ(identification.next_request().device, MotionRequest::Device::kNothing);
  for (int i = 0; i < 12'000; ++i) identification.add(bench.at({0.0, 0.0, 75.0}, 0.0, 0.0));
  EXPECT_EQ(identification.next_request().words.find("cool"), std::string::npos) << "cold again";
}

TEST(StructuralIdentification, APressOnARigidObjectAsksForNoMoreThanTheDeviceGives) {
  hal::RigInfo rig = light(hal::RigKind::kHardware);
  const MotionRequest bearable = StructuralIdentification({.rigid_contact = true}, rig).next_request();
  EXPECT_NEAR(bearable.max_device_force_n, 1.5 * 2.5 * 1.4, 1e-9);
  rig.device.max_continuous_force_n = 0.0;  // not known
  rig.device.max_force_n = 4.0;
  const MotionRequest weak = StructuralIdentification({.rigid_contact = true}, rig).next_request();
  EXPECT_NEAR(weak.max_device_force_n, 4.0, 1e-9);
}

TEST(StructuralIdentification, WithoutAnInstrumentItRefuses) {
  StructuralIdentification identification({}, high_force());
  StructuralBench bench{[](const Vector3&) { return 0.4; }};
  bench.watched = false;
  bench.press(identification, {0.0, 0.0, 70.0}, 0.5, 5.0);
  EXPECT_TRUE(holds(refusal_of(identification).remedy, "LVDT"));
  EXPECT_TRUE(holds(identification.progress().missing.front(), "instrument"));
}

TEST(StructuralIdentification, AnInstrumentAtItsStopIsNamed) {
  StructuralBench bench{[](const Vector3&) { return 0.3; }};
  StructuralIdentification identification({}, high_force());
  identification.add(bench.at({}, 0.0, 0.0));
  bench.watched = false;
  bench.follow(identification, 3);
  EXPECT_TRUE(holds(refusal_of(identification).what, "gave no reading most of the time"));
}

TEST(StructuralIdentification, ReversedSignIsRefused) {
  StructuralIdentification identification({.constant = true}, high_force());
  StructuralBench bench{[](const Vector3&) { return 0.4; }};
  bench.sign = -1.0;
  for (int i = 0; i < 5; ++i) bench.press(identification, {10.0 * i, 0.0, 70.0}, 0.5, 5.0);
  EXPECT_TRUE(holds(refusal_of(identification).remedy, "sign"));
}

TEST(StructuralIdentification, AWildPressAndUnfitSamplesAreLeftOut) {
  StructuralIdentification identification({.constant = true}, high_force());
  StructuralBench bench{[](const Vector3& p) { return 0.4 + 1e-3 * std::sin(p.z); }};
  for (int i = 0; i < 7; ++i) {
    if (i == 3) {  // someone leans on the instrument
      StructuralBench leaning = bench;
      leaning.compliance_mm_per_n = [](const Vector3& p) { return 0.4 + 0.2 * std::sin(0.7 * p.z); };
      leaning.press(identification, {0.0, 0.0, 70.0}, 0.5, 5.0);
      bench.time_ns = leaning.time_ns;
      continue;
    }
    bench.press(identification, {0.0, 0.0, 65.0 + i}, 0.5, 5.0);
    rt::Observation bad = bench.at({}, 0.0, 0.0);
    bad.sample.tip_position_mm.x = std::numeric_limits<double>::quiet_NaN();
    identification.add(bad);
    bad = bench.at({0.0, 0.0, 70.0}, 0.0, 0.0);
    bad.device_command_n.z = std::numeric_limits<double>::infinity();
    identification.add(bad);
  }
  const auto model = value_of(identification.finish());
  EXPECT_NEAR(std::get<rt::StructuralModel>(model.content).stiffness_n_per_mm, 2.5, 0.02);
  EXPECT_TRUE(has_remark(identification, "left out"));
}

TEST(StructuralIdentification, NothingAndConstantSignalsAreRefused) {
  StructuralIdentification identification({}, high_force());
  EXPECT_FALSE(identification.finish());
  StructuralBench bench{[](const Vector3&) { return 0.4; }};
  for (int i = 0; i < 5000; ++i) identification.add(bench.at({0.0, 0.0, 70.0}, 3.0, 0.0));
  EXPECT_FALSE(hapticd::test::error_of(identification.finish()).remedy.empty());
}

// ---- recordings ----

/// Presses on walls along `press`, watched from outside, sampled at `rate_hz`.
struct WatchedWalls {
  double rate_hz = 1000.0;
  Vector3 press{0.0, 0.0, -1.0};
  double stiffness_n_per_mm = 2.5;
  double noise_mm = 0.0;
  double drift_mm_per_s = 0.0;
  bool lets_go = true;
  std::mt19937 random{7};
  std::int64_t tick = 0;

  void add(Identification& identification, double depth_mm) {
    const double force_n = depth_mm > 0.0 ? 0.5 * depth_mm : 0.0;
    std::normal_distribution<double> noise(0.0, noise_mm > 0.0 ? noise_mm : 1e-12);
    const double time_s = static_cast<double>(tick++) / rate_hz;
    rt::Observation o;
    o.sample.time_ns = std::llround(1e9 * time_s);
    o.sample.tip_position_mm = press * depth_mm;
    o.device_command_n = press * -force_n;
    o.external_position_mm =
        press * (depth_mm + force_n / stiffness_n_per_mm + drift_mm_per_s * time_s + noise(random) + 3.0);
    o.has_external_position = true;
    identification.add(o);
  }
  /// 30 mm/s to 10 mm and up again.
  void follow(Identification& identification, int presses) {
    for (int i = 0; i < presses; ++i) {
      for (double x = -5.0; x < 10.0; x += 30.0 / rate_hz) add(identification, x);
      for (double x = 10.0; lets_go && x > -5.0; x -= 30.0 / rate_hz) add(identification, x);
      for (double t = 0.0; lets_go && t < 0.3; t += 1.0 / rate_hz) add(identification, -5.0);
    }
  }
};

TEST(StructuralIdentification, ARecordingMayBeSlowAndAlongAnyDirection) {
  for (const double rate_hz : {60.0, 250.0, 1000.0, 3000.0}) {
    for (const Vector3& press : {Vector3{0.0, 0.0, -1.0}, Vector3{1.0, 0.0, 0.0},
                                 Vector3{0.57735026919, 0.57735026919, -0.57735026919}}) {
      StructuralIdentification identification({.constant = true}, recording_rig(rate_hz));
      WatchedWalls walls{rate_hz, press};
      walls.follow(identification, 4);
      const auto model = identification.finish();
      ASSERT_TRUE(model) << rate_hz << " Hz: " << model.error().text();
      EXPECT_NEAR(std::get<rt::StructuralModel>(model->content).stiffness_n_per_mm, 2.5, 1e-3) << rate_hz;
      EXPECT_FALSE(model->converged) << "one place is not five";
    }
  }
}

TEST(StructuralIdentification, NoiseAndDriftOfTheInstrumentStayWithinItsUncertainty) {
  StructuralIdentification identification({.constant = true}, recording_rig(1000.0));
  WatchedWalls walls{.noise_mm = 0.03, .drift_mm_per_s = 0.01};
  walls.follow(identification, 6);
  const auto model = value_of(identification.finish());
  const double found = std::get<rt::StructuralModel>(model.content).stiffness_n_per_mm;
  const double error = parameter(model, "structural_stiffness_n_per_mm").standard_error;
  EXPECT_NEAR(found, 2.5, 0.025);
  EXPECT_LT(std::abs(found - 2.5), 4.0 * error);
  EXPECT_LT(error, 0.05);
}

TEST(StructuralIdentification, OneDirectionOnlyAndAnEndUnderLoadAreEnough) {
  StructuralIdentification identification({.constant = true}, recording_rig(1000.0));
  WatchedWalls walls{.lets_go = false};
  walls.follow(identification, 1);
  const auto model = value_of(identification.finish());
  EXPECT_NEAR(std::get<rt::StructuralModel>(model.content).stiffness_n_per_mm, 2.5, 1e-3);
  EXPECT_EQ(parameter(model, "back_drive_friction_n").standard_error, HUGE_VAL)
      << "nothing is known of friction";
}

TEST(StructuralIdentification, WithoutForceItSaysHowLittleThereWas) {
  for (const bool rigid : {false, true}) {
    StructuralIdentification identification({.rigid_contact = rigid}, recording_rig(1000.0));
    WatchedWalls walls;
    for (int i = 0; i < 5000; ++i) walls.add(identification, -1.0 - 1e-3 * i);
    const hal::Error refused = hapticd::test::error_of(identification.finish());
    EXPECT_TRUE(holds(refused.value, "greatest force is 0.000 N"));
    EXPECT_TRUE(holds(refused.remedy, "units of force"));
  }
}

// ---- rigid contact ----

/// The device presses its tip on an object, helped by a hand; the encoders follow the force.
struct RigidBench {
  double stiffness_n_per_mm = 2.5;
  double object_n_per_mm = 1e9;
  double friction_n = 0.0;
  double noise_mm = 0.0;
  double drift_mm_per_s = 0.0;
  double hand_share = 0.0;  ///< of the device's force
  double sign = 1.0;        ///< of the encoders
  double rate_n_per_s = 12.0;
  Vector3 into{0.0, 0.0, -1.0};
  std::mt19937 random{11};
  double bending_n = 0.0;
  std::int64_t tick = 0;

  rt::Observation at(double force_n, double lifted_mm) {
    std::normal_distribution<double> noise(0.0, noise_mm > 0.0 ? noise_mm : 1e-12);
    const double time_s = 1e-3 * static_cast<double>(tick++);
    const double reaction_n = (1.0 + hand_share) * force_n;
    // Dry friction: the encoders stick until the force has overcome it.
    bending_n = std::clamp(bending_n, force_n - friction_n, force_n + friction_n);
    const double bend_mm = bending_n / stiffness_n_per_mm;
    rt::Observation o;
    o.sample.time_ns = std::llround(1e9 * time_s);
    o.sample.tip_position_mm = into * (sign * (bend_mm + reaction_n / object_n_per_mm - lifted_mm) +
                                       drift_mm_per_s * time_s + noise(random));
    o.sample.sensor_force_n = into * -reaction_n;
    o.device_command_n = into * force_n;
    return o;
  }
  /// Touches down, presses to `force_n`, lets go and lifts.
  void press(Identification& identification, double force_n = 5.0) {
    const double step_n = 1e-3 * rate_n_per_s;
    for (int i = 300; i > 0; --i) identification.add(at(0.0, 0.05 * i));
    for (double f = 0.0; f < force_n; f += step_n) identification.add(at(f, 0.0));
    for (double f = force_n; f > 0.0; f -= step_n) identification.add(at(f, 0.0));
    for (int i = 0; i < 300; ++i) identification.add(at(0.0, 0.05 * i));
  }
};

TEST(StructuralIdentification, OnARigidObjectTheEncodersTellTheBend) {
  for (const Vector3& into : {Vector3{0.0, 0.0, -1.0}, Vector3{0.0, -1.0, 0.0}}) {
    StructuralIdentification identification({.rigid_contact = true}, high_force());
    RigidBench bench{.friction_n = 0.2, .into = into};
    for (int i = 0; i < 5; ++i) {
      EXPECT_EQ(identification.next_request().device, MotionRequest::Device::kModulation)
          << "the device presses";
      bench.press(identification);
    }
    const auto model = value_of(identification.finish());
    EXPECT_TRUE(model.converged);
    EXPECT_NEAR(std::get<rt::StructuralModel>(model.content).stiffness_n_per_mm, 2.5, 2.5e-3);
    EXPECT_NEAR(parameter(model, "back_drive_friction_n").value, 0.2, 0.03) << "turns of motion blur it";
    EXPECT_TRUE(holds(model.procedure, "lower bound"));
    EXPECT_EQ(identification.next_request().motion, MotionRequest::Motion::kRest);
  }
}

TEST(StructuralIdentification, WhatTheObjectGivesWayIsBetweenTheBounds) {
  const auto found = [](double object, double assumed, double hand_share) {
    StructuralIdentification identification(
        {.rigid_contact = true, .least_object_stiffness_n_per_mm = assumed}, high_force());
    RigidBench bench{.object_n_per_mm = object, .hand_share = hand_share};
    for (int i = 0; i < 5; ++i) bench.press(identification);
    auto model = identification.finish();
    EXPECT_TRUE(model) << model.error().text();
    return *model;
  };
  for (const double hand_share : {0.0, 0.5}) {
    const rt::IdentifiedModel model = found(200.0, 100.0, hand_share);
    const double lower = parameter(model, "structural_stiffness_n_per_mm").value;
    EXPECT_NEAR(lower, 1.0 / (1.0 / 2.5 + (1.0 + hand_share) / 200.0), 1e-3) << "as the formula has it";
    EXPECT_LT(lower, 2.5);
    EXPECT_GT(parameter(model, "structural_stiffness_upper_n_per_mm").value, 2.5);
    EXPECT_NEAR(parameter(model, "object_force_over_device_force").value, 1.0 + hand_share, 1e-6);
    EXPECT_GE(parameter(model, "structural_stiffness_n_per_mm").standard_error, 2.5 - lower);
  }
  // The object is just as stiff as was assumed: the upper bound is the truth.
  EXPECT_NEAR(parameter(found(200.0, 200.0, 0.5), "structural_stiffness_upper_n_per_mm").value, 2.5, 2e-3);
  // Nothing assumed but what is usual: the error widens by little.
  const rt::IdentifiedModel usual = found(1e9, 1000.0, 0.0);
  EXPECT_EQ(parameter(usual, "least_object_stiffness_n_per_mm").value, 1000.0);
  EXPECT_NEAR(parameter(usual, "structural_stiffness_n_per_mm").standard_error, 2.5 * 2.5 / 1000.0, 1e-4);
}

TEST(StructuralIdentification, NoiseAndDriftOfTheEncodersOnARigidObjectStayWithinTheUncertainty) {
  StructuralIdentification identification({.rigid_contact = true}, high_force());
  RigidBench bench{.noise_mm = 0.01, .drift_mm_per_s = 0.01};
  for (int i = 0; i < 6; ++i) bench.press(identification);
  const auto model = value_of(identification.finish());
  const double found = std::get<rt::StructuralModel>(model.content).stiffness_n_per_mm;
  EXPECT_NEAR(found, 2.5, 0.025);
  EXPECT_LT(std::abs(found - 2.5), 4.0 * parameter(model, "structural_stiffness_n_per_mm").standard_error);
}

TEST(StructuralIdentification, AnObjectAssumedAsSoftAsTheDeviceIsRefused) {
  StructuralIdentification identification({.rigid_contact = true, .least_object_stiffness_n_per_mm = 2.0},
                                          high_force());
  RigidBench bench{.object_n_per_mm = 10.0};
  for (int i = 0; i < 5; ++i) bench.press(identification);
  EXPECT_TRUE(holds(refusal_of(identification).remedy, "least_object_stiffness_n_per_mm"));
}

TEST(StructuralIdentification, AnObjectThatGivesWayIsNamed) {
  // The device's force stays small, and the encoders go the other way: the object is what moves.
  const auto pressed = [](hal::RigKind kind, int presses) {
    hal::RigInfo rig = high_force();
    rig.kind = kind;
    StructuralIdentification identification({.rigid_contact = true}, rig);
    RigidBench bench{.sign = -1.0};
    for (int i = 0; i < presses; ++i) bench.press(identification, 1.5);
    return identification;
  };
  constexpr const char* kGivesWay = "the object gives way: press wood or steel";
  EXPECT_EQ(pressed(hal::RigKind::kHardware, 1).progress().missing.front().find(kGivesWay),
            std::string::npos);
  for (const int presses : {4, 40}) {
    const StructuralIdentification simulated = pressed(hal::RigKind::kSimulated, presses);
    const std::string missing = simulated.progress().missing.front();
    EXPECT_TRUE(holds(missing, kGivesWay));
    const std::string remedy = refusal_of(simulated).remedy;
    EXPECT_TRUE(holds(remedy, kGivesWay));
    EXPECT_TRUE(holds(remedy, "hapticctl sim object wood_plate"));
    EXPECT_EQ(remedy.find("signs"), std::string::npos) << remedy;
  }
  const StructuralIdentification hardware = pressed(hal::RigKind::kHardware, 4);
  EXPECT_TRUE(holds(hardware.next_request().words, kGivesWay));
  EXPECT_EQ(refusal_of(hardware).remedy, kGivesWay);
  EXPECT_TRUE(holds(refusal_of(pressed(hal::RigKind::kReplay, 4)).remedy, "signs"));
}

TEST(StructuralIdentification, ARigidContactThatSaysNothingIsRefused) {
  // Encoders counted the other way.
  StructuralIdentification reversed({.rigid_contact = true}, high_force());
  RigidBench bench{.sign = -1.0};
  for (int i = 0; i < 5; ++i) bench.press(reversed);
  EXPECT_TRUE(holds(refusal_of(reversed).remedy, "signs"));

  // One force, held: no change, no deflection.
  StructuralIdentification held({.rigid_contact = true}, high_force());
  RigidBench still;
  for (int i = 0; i < 3000; ++i) held.add(still.at(4.0, 0.0));
  EXPECT_TRUE(holds(refusal_of(held).limit, "N/s"));

  // No numbers at all.
  StructuralIdentification unfit({.rigid_contact = true}, high_force());
  for (int i = 0; i < 100; ++i) {
    rt::Observation o = still.at(4.0, 0.0);
    o.sample.sensor_force_n.z = std::numeric_limits<double>::quiet_NaN();
    unfit.add(o);
  }
  EXPECT_FALSE(unfit.finish());
  EXPECT_TRUE(holds(unfit.progress().remarks.front(), "unfit"));
}

}  // namespace
}  // namespace hapticd::identification
