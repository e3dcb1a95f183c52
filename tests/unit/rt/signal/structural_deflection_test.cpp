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

/// A disturbed loop F(k) = F(k-1) + Kp (F~ - F(k-1)), F~ = k~ x̂ - f_r: what is left of the disturbance in
/// the end, relative to it.
template <class Displacement>
double left_after(int ticks, double target_n_per_mm, const Displacement& displacement_mm) {
  double force = 1.0;
  double largest = 0.0;
  for (int k = 0; k < ticks; ++k) {
    force += kGain * (target_n_per_mm * displacement_mm(force) - force);
    if (!(std::abs(force) < 1e12)) return HUGE_VAL;
    if (k > ticks / 2) largest = std::max(largest, std::abs(force));
  }
  return largest;
}

TEST(StructuralDeflection, WithTheWrongSignTheLoopDivergesBeyondAKnownTarget) {
  // x̂ = x_s - F/k_s, what (4.25) says for a device that pushes outwards with F: pole 1 - Kp (1 + k~/k_s).
  const double limit = kStructureNPerMm * (2.0 / kGain - 1.0);
  EXPECT_NEAR(limit, 2.30, 0.01);
  for (const bool beyond : {false, true}) {
    StructuralDeflection deflection(kStructureNPerMm, 0.0, 1000.0);
    const double left = left_after(4000, (beyond ? 1.02 : 0.98) * limit, [&](double force) {
      return -deflection.update({0.0, 0.0, force}).z;
    });
    if (beyond) {
      EXPECT_GT(left, 1e3);
    } else {
      EXPECT_LT(left, 1e-3);
    }
  }
}

/// The tip is held by the object. The motors take `share` of what is missing each tick; the encoders see the
/// tip less what the motors really bend, and the estimate adds what it thinks they do.
double left_with_motors(double target_n_per_mm, double share, double cutoff_hz) {
  StructuralDeflection deflection(kStructureNPerMm, cutoff_hz, 1000.0);
  double motors_n = 0.0;
  return left_after(4000, target_n_per_mm, [&](double force) {
    motors_n += share * (force - motors_n);
    return deflection.update({0.0, 0.0, force}).z - motors_n / kStructureNPerMm;
  });
}

TEST(StructuralDeflection, PutInAtOnceItRunsAheadOfTheMotorsAndDiverges) {
  for (const double share : {0.25, 0.4}) {
    // With F_m lagging by a share a the loop is stable below k~ = k_s (1 + a/Kp) about.
    EXPECT_GT(left_with_motors(2.0 * kStructureNPerMm, share, 0.0), 1e3) << share;
  }
}

TEST(StructuralDeflection, ThroughTheLagTheLoopIsStableWithMotorsOfAFewTicks) {
  for (const double share : {0.2, 0.25, 0.4, 0.6}) {
    for (const double relative : {0.2, 1.0, 2.0}) {
      EXPECT_LT(left_with_motors(relative * kStructureNPerMm, share, 10.0), 1e-3)
          << share << ", k~/k_s " << relative;
    }
  }
}

}  // namespace
}  // namespace hapticd::rt
