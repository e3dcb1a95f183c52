// Structural stiffness from pressed walls: synthetic devices whose bend is known in closed form.

#include "rt/identify/structural_identification.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>

namespace hapticd::rt {
namespace {

using hal::Vector3;

hal::RigInfo high_force() {
  hal::RigInfo rig;
  rig.device.model = "phantom_1_5_high_force";
  rig.device.max_force_n = 37.5;
  rig.rate_hz = 1000.0;
  return rig;
}

/// A device of compliance c(p) with dry friction, seen by encoders and from outside; presses walls as wished.
struct Bench {
  std::function<double(const Vector3&)> compliance_mm_per_n;
  double friction_n = 0.0;
  double sign = 1.0;  ///< of the bend
  bool watched = true;
  std::int64_t time_ns = 0;

  Observation at(const Vector3& encoder_mm, double force_n, double speed_mm_per_s) {
    Observation o;
    time_ns += 1'000'000;
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
      const Wish wish = identification.wish();
      if (wish.motion != Wish::Motion::kPress) return;
      press(identification, wish.place_mm, wish.stiffness_n_per_mm, wish.force_n);
    }
  }
};

TEST(StructuralIdentification, FindsAConstantStiffnessExactly) {
  StructuralIdentification identification({.constant = true}, high_force());
  Bench bench{[](const Vector3&) { return 1.0 / 2.537; }};
  bench.follow(identification, 8);
  const auto model = identification.finish();
  ASSERT_TRUE(model) << model.error().text();
  EXPECT_TRUE(model->converged);
  const auto& structure = std::get<StructuralModel>(model->content);
  EXPECT_NEAR(structure.stiffness_n_per_mm, 2.537, 1e-6);
  EXPECT_EQ(structure.gradient_per_mm.x, 0.0);
  EXPECT_LT(model->residual, 1e-4);
  EXPECT_EQ(identification.wish().motion, Wish::Motion::kRest) << "nothing more is wanted";
}

TEST(StructuralIdentification, DryFrictionOfTheMotorsIsToldFromTheBend) {
  StructuralIdentification identification({.constant = true}, high_force());
  Bench bench{[](const Vector3&) { return 0.4; }, 0.2};
  bench.follow(identification, 8);
  const auto model = identification.finish();
  ASSERT_TRUE(model);
  EXPECT_NEAR(std::get<StructuralModel>(model->content).stiffness_n_per_mm, 2.5, 1e-4);
  bool told = false;
  for (const EstimatedParameter& p : model->parameters) {
    if (p.name != "back_drive_friction_n") continue;
    told = true;
    EXPECT_NEAR(p.value, 0.2, 1e-3);
  }
  EXPECT_TRUE(told);
}

TEST(StructuralIdentification, FindsAQuadraticField) {
  const Vector3 centre{0.0, 0.0, 70.0};
  const auto c = [&](const Vector3& p) {
    const Vector3 q = p - centre;
    return 0.4 * (1.0 + 1e-3 * q.x - 5e-4 * q.y + 8e-4 * q.z + 4e-6 * q.x * q.x + 6e-6 * q.z * q.z +
                  2.0 * (2e-6 * q.x * q.y - 1e-6 * q.y * q.z));
  };
  StructuralIdentification identification({}, high_force());
  Bench bench{c};
  bench.follow(identification, 30);
  const auto model = identification.finish();
  ASSERT_TRUE(model);
  EXPECT_TRUE(model->converged);
  const auto& structure = std::get<StructuralModel>(model->content);
  for (const Vector3& p :
       {Vector3{0.0, 0.0, 70.0}, Vector3{70.0, -40.0, 100.0}, Vector3{-80.0, 50.0, 40.0}}) {
    EXPECT_NEAR(structure.stiffness_at(p) * c(p), 1.0, 1e-4);
  }
}

TEST(StructuralIdentification, AConstantModelOfAFieldSaysSo) {
  StructuralIdentification identification({.constant = true}, high_force());
  Bench bench{[](const Vector3& p) { return 0.4 * (1.0 + 2e-3 * p.x); }};
  bench.follow(identification, 10);
  const IdentificationProgress progress = identification.progress();
  bool said = false;
  for (const std::string& remark : progress.remarks)
    said = said || remark.find("ask for a field") != std::string::npos;
  EXPECT_TRUE(said);
}

TEST(StructuralIdentification, OnePressTellsNoField) {
  StructuralIdentification identification({}, high_force());
  Bench bench{[](const Vector3&) { return 0.4; }};
  bench.follow(identification, 1);
  const auto model = identification.finish();
  ASSERT_TRUE(model);
  EXPECT_FALSE(model->converged);
  EXPECT_EQ(std::get<StructuralModel>(model->content).curvature_per_mm2[0], 0.0);
  EXPECT_FALSE(identification.progress().missing.empty());
}

TEST(StructuralIdentification, WithoutAnInstrumentItRefuses) {
  StructuralIdentification identification({}, high_force());
  Bench bench{[](const Vector3&) { return 0.4; }};
  bench.watched = false;
  bench.press(identification, {0.0, 0.0, 70.0}, 0.5, 5.0);
  const auto model = identification.finish();
  ASSERT_FALSE(model);
  EXPECT_NE(model.error().remedy.find("LVDT"), std::string::npos);
  EXPECT_NE(identification.progress().missing.front().find("instrument"), std::string::npos);
}

TEST(StructuralIdentification, ReversedSignIsRefused) {
  StructuralIdentification identification({.constant = true}, high_force());
  Bench bench{[](const Vector3&) { return 0.4; }};
  bench.sign = -1.0;
  for (int i = 0; i < 5; ++i) bench.press(identification, {10.0 * i, 0.0, 70.0}, 0.5, 5.0);
  const auto model = identification.finish();
  ASSERT_FALSE(model);
  EXPECT_NE(model.error().remedy.find("sign"), std::string::npos);
}

TEST(StructuralIdentification, AWildPressAndUnfitSamplesAreLeftOut) {
  StructuralIdentification identification({.constant = true}, high_force());
  Bench bench{[](const Vector3& p) { return 0.4 + 1e-3 * std::sin(p.z); }};
  for (int i = 0; i < 7; ++i) {
    if (i == 3) {  // somebody leans on the instrument
      Bench leaning = bench;
      leaning.compliance_mm_per_n = [](const Vector3& p) { return 0.4 + 0.2 * std::sin(0.7 * p.z); };
      leaning.press(identification, {0.0, 0.0, 70.0}, 0.5, 5.0);
      bench.time_ns = leaning.time_ns;
      continue;
    }
    bench.press(identification, {0.0, 0.0, 65.0 + i}, 0.5, 5.0);
    Observation bad = bench.at({}, 0.0, 0.0);
    bad.sample.tip_position_mm.x = std::numeric_limits<double>::quiet_NaN();
    identification.add(bad);
    bad = bench.at({0.0, 0.0, 70.0}, 0.0, 0.0);
    bad.device_command_n.z = std::numeric_limits<double>::infinity();
    identification.add(bad);
  }
  const auto model = identification.finish();
  ASSERT_TRUE(model) << model.error().text();
  EXPECT_NEAR(std::get<StructuralModel>(model->content).stiffness_n_per_mm, 2.5, 0.02);
  bool told = false;
  for (const std::string& remark : identification.progress().remarks) {
    told = told || remark.find("left out") != std::string::npos;
  }
  EXPECT_TRUE(told);
}

TEST(StructuralIdentification, NothingAndConstantSignalsAreRefused) {
  StructuralIdentification identification({}, high_force());
  EXPECT_FALSE(identification.finish());
  Bench bench{[](const Vector3&) { return 0.4; }};
  for (int i = 0; i < 5000; ++i) identification.add(bench.at({0.0, 0.0, 70.0}, 3.0, 0.0));
  const auto model = identification.finish();
  ASSERT_FALSE(model);
  EXPECT_FALSE(model.error().remedy.empty());
}

}  // namespace
}  // namespace hapticd::rt
