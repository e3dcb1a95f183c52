#include "rt/signal/structural_deflection.h"

#include "tests/unit/rt/deformation/directions.h"

namespace hapticd::rt {
namespace {

using namespace test;

constexpr double kStructureNPerMm = 2.537;
constexpr double kGain = 1.05;  // Kp of the high-force device

TEST(StructuralDeflection, PushingTheUserOutTheTipIsDeeperThanTheEncodersSay) {
  StructuralDeflection deflection(2.5, 0.0, 1000.0);
  const hal::Vector3 encoders{0.0, 0.0, -3.0};  // 3 mm below a surface whose outside is +z
  const hal::Vector3 tip = encoders - deflection.update({0.0, 0.0, 1.0});
  EXPECT_NEAR(tip.z, -3.4, 1e-12) << "p = p_s - f_d/k_s";
}

TEST(StructuralDeflection, SettlesAtForceOverStiffnessWhateverTheCutoff) {
  for (const double cutoff_hz : {0.0, 1.0, 10.0, 100.0}) {
    for (const double rate_hz : {500.0, 1000.0, 5000.0}) {
      StructuralDeflection deflection(3.5, cutoff_hz, rate_hz);
      hal::Vector3 bent;
      for (int i = 0; i < 20'000; ++i) bent = deflection.update({3.5, -7.0, 1.75});
      expect_near(bent, {1.0, -2.0, 0.5}, 1e-6);
    }
  }
}

TEST(StructuralDeflection, WithoutACutoffItFollowsAtOnceWithOneAsAFirstOrderLag) {
  StructuralDeflection at_once(2.0, 0.0, 1000.0);
  expect_near(at_once.update({2.0, 0.0, 0.0}), {1.0, 0.0, 0.0}, 1e-15);
  expect_near(at_once.update({0.0, 0.0, 4.0}), {0.0, 0.0, 2.0}, 1e-15);
  StructuralDeflection lag(2.0, 10.0, 1000.0);
  for (int i = 1; i <= 200; ++i) {
    EXPECT_NEAR(lag.update({2.0, 0.0, 0.0}).x, 1.0 - std::exp(-2.0 * std::numbers::pi * 0.01 * i), 1e-9);
  }
  lag.reset();
  EXPECT_EQ(norm(lag.update({})), 0.0);
}

TEST(StructuralDeflection, ARigidDeviceDoesNotBend) {
  StructuralDeflection rigid(0.0, 10.0, 1000.0);
  for (int i = 0; i < 1000; ++i) EXPECT_EQ(norm(rigid.update({8.0, -8.0, 8.0})), 0.0);
}

/// A disturbed loop F(k) = F(k-1) + Kp (F~ - F(k-1)), F~ = k~ x̂ - f_r, whose tip is held by the object: what
/// is left of the disturbance in the end, relative to it. The motors take `share` of what is missing each
/// tick; the encoders see the tip less what the motors really bend, and the estimate adds what it thinks they
/// do.
double left_with_motors(double target_n_per_mm, double share) {
  StructuralDeflection deflection(kStructureNPerMm, 10.0, 1000.0);
  double motors_n = 0.0;
  double force = 1.0;
  double largest = 0.0;
  for (int k = 0; k < 4000; ++k) {
    motors_n += share * (force - motors_n);
    const double displacement_mm = deflection.update({0.0, 0.0, force}).z - motors_n / kStructureNPerMm;
    force += kGain * (target_n_per_mm * displacement_mm - force);
    if (!(std::abs(force) < 1e12)) return HUGE_VAL;
    if (k > 2000) largest = std::max(largest, std::abs(force));
  }
  return largest;
}

TEST(StructuralDeflection, ThroughTheLagTheLoopIsStableWithMotorsOfAFewTicks) {
  for (const double share : {0.2, 0.25, 0.4, 0.6}) {
    for (const double relative : {0.2, 1.0, 2.0}) {
      EXPECT_LT(left_with_motors(relative * kStructureNPerMm, share), 1e-3)
          << share << ", k~/k_s " << relative;
    }
  }
}

}  // namespace
}  // namespace hapticd::rt
