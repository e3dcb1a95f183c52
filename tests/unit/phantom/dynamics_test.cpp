// The arm as rigid bodies, against the figures known of a Premium 1.5 and against energy.

#include "tests/reference/dynamics.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "hal/phantom/phantom_config.h"

namespace hapticd::phantom {
namespace {

const ArmGeometry kArm = PhantomConfig{}.arm;

TEST(Dynamics, ApparentMassAtTheResetPose) {
  const ArmInertia inertia = premium_1_5_inertia();
  EXPECT_NEAR(1e3 * apparent_mass_kg(kArm, inertia, {}, {1.0, 0.0, 0.0}), 32.0, 0.5);
  EXPECT_NEAR(1e3 * apparent_mass_kg(kArm, inertia, {}, {0.0, 1.0, 0.0}), 77.0, 0.5);
  EXPECT_NEAR(1e3 * apparent_mass_kg(kArm, inertia, {}, {0.0, 0.0, 1.0}), 53.0, 0.6);
  EXPECT_NEAR(apparent_mass_kg(kArm, inertia, {}, {0.0, 0.0, -5.0}),
              apparent_mass_kg(kArm, inertia, {}, {0.0, 0.0, 1.0}), 1e-12)
      << "length and sense of the direction do not matter";
}

/// Kinetic energy of the bodies, their centres' speeds by differences: what the inertia matrix must show.
double energy_j(const ArmInertia& b, const JointAngles& q, const JointAngles& speed) {
  const double l1 = 1e-3 * kArm.first_link_mm;
  const double l2 = 1e-3 * kArm.second_link_mm;
  constexpr double kStep = 1e-6;
  const auto centre_speed = [&](auto centre) {
    JointAngles ahead = q;
    JointAngles behind = q;
    for (std::size_t i = 0; i < 3; ++i) {
      ahead[i] += kStep * speed[i];
      behind[i] -= kStep * speed[i];
    }
    const hal::Vector3 step = centre(ahead) - centre(behind);
    return std::sqrt(dot(step, step)) / (2.0 * kStep);
  };
  const auto place = [](double turn, double out, double up) {
    return hal::Vector3{out * std::cos(turn), out * std::sin(turn), up};
  };
  const double second = centre_speed([&](const JointAngles& p) {
    return place(p[0], l1 * std::cos(p[1]) + 0.5 * l2 * std::sin(p[2]),
                 l1 * std::sin(p[1]) - 0.5 * l2 * std::cos(p[2]));
  });
  const double rod = centre_speed([&](const JointAngles& p) {
    return place(p[0], 0.5 * l1 * std::cos(p[1]) + b.crank_length_m * std::sin(p[2]),
                 0.5 * l1 * std::sin(p[1]) - b.crank_length_m * std::cos(p[2]));
  });
  // Turning: across the arm's plane by its own joint, about the vertical by the base's.
  const auto turning = [&](const LinkInertia& link, std::size_t joint) {
    const double y = speed[0] * std::cos(q[joint]);
    const double z = speed[0] * std::sin(q[joint]);
    return link.xx_kg_m2 * speed[joint] * speed[joint] + link.yy_kg_m2 * y * y + link.zz_kg_m2 * z * z;
  };
  return 0.5 * (b.second_link.mass_kg * second * second + b.rod.mass_kg * rod * rod +
                turning(b.second_link, 2) + turning(b.crank, 2) + turning(b.rod, 1) +
                turning(b.first_link, 1) + b.base_yy_kg_m2 * speed[0] * speed[0]);
}

TEST(Dynamics, InertiaSaysTheBodiesEnergy) {
  const ArmInertia inertia = premium_1_5_inertia();
  std::mt19937_64 random(3);
  std::uniform_real_distribution<double> angle(-1.0, 1.0);
  for (int k = 0; k < 200; ++k) {
    const JointAngles q{angle(random), angle(random), angle(random)};
    const JointAngles speed{angle(random), angle(random), angle(random)};
    const auto m = inertia_kg_m2(kArm, inertia, q);
    double energy = 0.0;
    for (std::size_t i = 0; i < 3; ++i) {
      for (std::size_t j = 0; j < 3; ++j) energy += 0.5 * speed[i] * m[i][j] * speed[j];
    }
    EXPECT_NEAR(energy, energy_j(inertia, q, speed), 1e-7 * energy);
  }
}

TEST(Dynamics, ApparentMassIsWhatAPushMoves) {
  // A unit force for a short while from rest: the tip's acceleration along it is 1/m.
  const ArmInertia inertia = premium_1_5_inertia();
  const JointAngles q{0.4, 0.5, 0.3};
  const hal::Vector3 u{0.6, 0.0, 0.8};
  const auto m = inertia_kg_m2(kArm, inertia, q);
  const auto torque = torques_for_n_mm(kArm, q, u * 1e-3);  // N·m
  const double determinant = m[1][1] * m[2][2] - m[1][2] * m[2][1];
  const double a1 = torque[0] / m[0][0];
  const double a2 = (m[2][2] * torque[1] - m[1][2] * torque[2]) / determinant;
  const double a3 = (m[1][1] * torque[2] - m[2][1] * torque[1]) / determinant;
  const Jacobian j = jacobian(kArm, q);
  const double along = 1e-3 * (u.x * (j[0][0] * a1 + j[0][1] * a2 + j[0][2] * a3) +
                               u.y * (j[1][0] * a1 + j[1][1] * a2 + j[1][2] * a3) +
                               u.z * (j[2][0] * a1 + j[2][1] * a2 + j[2][2] * a3));
  EXPECT_NEAR(apparent_mass_kg(kArm, inertia, q, u), 1.0 / along, 1e-12);
}

}  // namespace
}  // namespace hapticd::phantom
