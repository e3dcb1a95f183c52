#include "rt/control/hand_port_passivity.h"

#include "tests/unit/rt/deformation/directions.h"

namespace hapticd::rt {
namespace {

using namespace test;

/// The force of a spring over a tick, as a sensor averages it; +z is out of the object.
double mean_spring_n(double stiffness, double before_mm, double now_mm) {
  return 0.5 * stiffness * (std::max(0.0, before_mm) + std::max(0.0, now_mm));
}

TEST(HandPortPassivity, ALosslessSpringReturnsWhatItTookAndIsLeftAlone) {
  for (const double stiffness : {0.1, 1.0, 20.0}) {
    HandPortPassivity port(1000.0);
    port.begin();
    double x = 0.0;
    double largest = 0.0;
    for (int i = 1; i <= 10'000; ++i) {
      const double before = x;
      x = 2.0 * (1.0 - std::cos(2.0 * std::numbers::pi * 1e-3 * i));  // 4 mm once a second
      const hal::Vector3 step{0.0, 0.0, before - x};
      const hal::Vector3 added =
          port.update({0.0, 0.0, mean_spring_n(stiffness, before, x)}, {}, step, step * 1000.0);
      ASSERT_EQ(norm(added), 0.0);
      ASSERT_NEAR(port.energy_mj(), 0.5 * stiffness * x * x, 1e-6 * stiffness) << "½ k x²";
      largest = std::max(largest, port.energy_mj());
    }
    EXPECT_NEAR(port.energy_mj(), 0.0, 1e-6 * stiffness);
    EXPECT_NEAR(largest, 8.0 * stiffness, 1e-6 * stiffness);
  }
}

TEST(HandPortPassivity, SofteningIsNoFaultWhereTheHandStillPays) {
  // The device takes away half of what the object gives: active at its own port, passive at the hand's.
  HandPortPassivity port(1000.0);
  port.begin();
  double x = 0.0;
  for (int i = 1; i <= 5000; ++i) {
    const double before = x;
    x = 2.0 * (1.0 - std::cos(2.0 * std::numbers::pi * 1e-3 * i));
    const double object_n = mean_spring_n(1.0, before, x);
    const hal::Vector3 step{0.0, 0.0, before - x};
    ASSERT_EQ(norm(port.update({0.0, 0.0, object_n}, {0.0, 0.0, -0.5 * object_n}, step, step * 1000.0)), 0.0);
  }
}

struct Shaken {
  double min_energy_mj = 0.0;
  double largest_damping = 0.0;
  double largest_force_share = 0.0;  ///< of what the bound allows
  int damped_ticks = 0;
};

/// A hand that moves back and forth in a spring that is rendered with a delay: each cycle gains π k a²
/// sin(ωτ).
Shaken shake_a_delayed_spring(int delay_ticks, bool controlled) {
  constexpr double kStiffness = 0.5;
  HandPortPassivity port(1000.0);
  port.begin();
  std::vector<double> past(static_cast<std::size_t>(delay_ticks) + 1, 2.0);
  Shaken seen;
  double damper_n = 0.0;
  double x = 2.0;
  for (int i = 1; i <= 20'000; ++i) {
    const double before = x;
    x = 2.0 + 1.0 * std::sin(2.0 * std::numbers::pi * 3e-3 * i);  // 3 Hz
    const double delayed = past[static_cast<std::size_t>(i) % past.size()];
    past[static_cast<std::size_t>(i) % past.size()] = x;
    const hal::Vector3 step{0.0, 0.0, before - x};
    const hal::Vector3 velocity = step * 1000.0;
    const hal::Vector3 added =
        port.update({}, {0.0, 0.0, kStiffness * delayed + (controlled ? damper_n : 0.0)}, step, velocity);
    damper_n = added.z;
    EXPECT_LE(dot(added, velocity), 0.0) << "it only ever takes";
    seen.min_energy_mj = std::min(seen.min_energy_mj, port.energy_mj());
    seen.largest_damping = std::max(seen.largest_damping, port.damping_n_s_per_mm());
    if (norm(velocity) > 0.0) {
      seen.largest_force_share = std::max(
          seen.largest_force_share, norm(added) / (HandPortPassivity::kMaxDampingNsPerMm * norm(velocity)));
    }
    if (port.damping_n_s_per_mm() > 0.0) ++seen.damped_ticks;
  }
  return seen;
}

TEST(HandPortPassivity, ASpringThatIsLateIsDampedAndItsDeficitBounded) {
  for (const int delay : {5, 10, 20}) {
    const Shaken without = shake_a_delayed_spring(delay, false);
    const Shaken with = shake_a_delayed_spring(delay, true);
    EXPECT_LT(without.min_energy_mj, -5.0) << delay << " ms: it gives and gives";
    EXPECT_GT(with.damped_ticks, 0) << delay;
    EXPECT_GT(with.min_energy_mj, -3.5) << delay << " ms: bounded, over 60 cycles";
    EXPECT_LE(with.largest_damping, HandPortPassivity::kMaxDampingNsPerMm);
    EXPECT_LE(with.largest_force_share, 1.0 + 1e-9);
  }
}

TEST(HandPortPassivity, DampingKeepsItsBoundWhateverCame) {
  std::mt19937_64 random(50);
  std::uniform_real_distribution<double> size(-6.0, 4.0);
  HandPortPassivity port(1000.0);
  port.begin();
  for (int i = 0; i < 100'000; ++i) {
    if (i % 5000 == 0) port.begin();
    const hal::Vector3 velocity = random_vector(random, std::pow(10.0, size(random)));
    const hal::Vector3 added =
        port.update(random_vector(random, std::pow(10.0, size(random))), random_vector(random, 8.0),
                    random_vector(random, 1e-3 * std::pow(10.0, size(random))), velocity);
    ASSERT_TRUE(finite(added));
    ASSERT_GE(port.damping_n_s_per_mm(), 0.0);
    ASSERT_LE(port.damping_n_s_per_mm(), HandPortPassivity::kMaxDampingNsPerMm);
    ASSERT_LE(norm(added + velocity * port.damping_n_s_per_mm()), 1e-9 * norm(velocity))
        << "against the motion";
  }
}

TEST(HandPortPassivity, MinutesAtRestAddNothing) {
  HandPortPassivity port(1000.0);
  port.begin();
  for (int i = 0; i < 100; ++i) port.update({}, {0.0, 0.0, 3.0}, {0.0, 0.0, 0.01}, {0.0, 0.0, 10.0});
  EXPECT_NEAR(port.energy_mj(), -3.0, 1e-9);
  for (int i = 0; i < 600'000; ++i) {
    ASSERT_EQ(norm(port.update({0.1, 0.2, 2.0}, {0.0, 0.0, 3.0}, {}, {})), 0.0);
  }
  EXPECT_NEAR(port.energy_mj(), -3.0, 1e-9);
  port.begin();
  EXPECT_EQ(port.energy_mj(), 0.0) << "a new contact owes nothing";
  EXPECT_EQ(port.damping_n_s_per_mm(), 0.0);
}

TEST(HandPortPassivity, WithinTheToleranceNothingIsDone) {
  HandPortPassivity port(1000.0);
  port.begin();
  EXPECT_EQ(norm(port.update({}, {0.0, 0.0, 1.0}, {0.0, 0.0, 0.49}, {0.0, 0.0, 490.0})), 0.0);
  EXPECT_GT(norm(port.update({}, {0.0, 0.0, 1.0}, {0.0, 0.0, 0.05}, {0.0, 0.0, 50.0})), 0.0);
}

}  // namespace
}  // namespace hapticd::rt
