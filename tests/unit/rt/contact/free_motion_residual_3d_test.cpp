#include <gtest/gtest.h>

#include <array>

#include "rt/contact/free_motion_residual.h"
#include "rt/signal/tool_compensation.h"
#include "tests/unit/rt/deformation/directions.h"

namespace hapticd::rt {
namespace {

using namespace test;

constexpr double kMassG = 12.59;
constexpr std::int64_t kPeriodNs = 1'000'000;

/// A hand that waves the tool about: three sines on each axis, together about 1 g at the peak.
class RandomMotion {
 public:
  explicit RandomMotion(std::uint64_t seed) {
    std::mt19937_64 random(seed);
    std::uniform_real_distribution<double> hz(0.3, 7.0), phase(0.0, 2.0 * std::numbers::pi);
    for (auto& axis : waves_) {
      for (Wave& wave : axis) {
        wave = {2.0 * std::numbers::pi * hz(random), phase(random)};
      }
    }
  }
  hal::Vector3 position_mm(double t) const {
    return each([t](const Wave& w) { return kPeakMmPerS2 / (w.omega * w.omega) * std::sin(w.at(t)); });
  }
  hal::Vector3 force_n(double t) const {  // m a, mean over the tick that ends at t
    const double middle = t - 0.5e-3;
    return each([middle](const Wave& w) { return -kPeakMmPerS2 * std::sin(w.at(middle)); }) *
           inertial_force_n(kMassG, 1.0);
  }

 private:
  static constexpr double kPeakMmPerS2 = 2000.0;  // of each of the nine
  struct Wave {
    double omega = 1.0, phase = 0.0;
    double at(double t) const { return omega * t + phase; }
  };
  template <class F>
  hal::Vector3 each(const F& of) const {
    std::array<double, 3> sum{};
    for (std::size_t i = 0; i < 3; ++i) {
      for (const Wave& wave : waves_[i]) sum[i] += of(wave);
    }
    return {sum[0], sum[1], sum[2]};
  }
  std::array<std::array<Wave, 3>, 3> waves_;
};

hal::Vector3 quantised(const hal::Vector3& v, double step) {
  return {step * std::round(v.x / step), step * std::round(v.y / step), step * std::round(v.z / step)};
}

TEST(FreeMotionResidual3, FreeMotionInSpaceLeavesNothing) {
  for (std::uint64_t seed = 1; seed <= 8; ++seed) {
    const RandomMotion motion(seed);
    for (const double step_mm : {1e-6, 0.03}) {
      FreeMotionResidual3 residual(kMassG, 1000.0);
      double largest = 0.0;
      double largest_force = 0.0;
      for (int i = 0; i < 8000; ++i) {
        const double t = i * 1e-3;
        const hal::Vector3 force = motion.force_n(t);
        const double r =
            norm(residual.update(force, quantised(motion.position_mm(t), step_mm), i * kPeriodNs, false));
        if (i < 500) continue;
        largest = std::max(largest, r);
        largest_force = std::max(largest_force, norm(force));
      }
      EXPECT_LT(largest, step_mm < 0.01 ? 1e-3 : 0.010) << "half the threshold of 20 mN; seed " << seed;
      EXPECT_GT(largest_force, 0.05) << "there was something to explain; seed " << seed;
    }
  }
}

TEST(FreeMotionResidual3, OnOneAxisItIsTheOneDimensionalClassOnAnyItIsAsGood) {
  std::mt19937_64 random(4);
  std::normal_distribution<double> noise(0.0, 0.05);
  std::uniform_int_distribution<int> dice(0, 99);
  for (int round = 0; round < 6; ++round) {
    const hal::Vector3 axis = round == 0 ? hal::Vector3{0.0, 0.0, 1.0} : random_direction(random);
    FreeMotionResidual one(kMassG, 1000.0);
    FreeMotionResidual3 three(kMassG, 1000.0);
    double position = 0.0, velocity = 0.0;
    std::int64_t time_ns = 0;
    for (int i = 0; i < 5000; ++i) {
      time_ns += dice(random) == 0 ? 20 * kPeriodNs : kPeriodNs + 10'000 * (dice(random) - 50);
      velocity += noise(random);
      position += 0.1 * velocity;
      const double force = 0.1 * std::sin(0.01 * i) + 0.2 * noise(random);
      const bool in_contact = (i / 700) % 2 == 1;
      const double r1 = one.update(force, position, time_ns, in_contact);
      const hal::Vector3 r3 = three.update(axis * force, axis * position, time_ns, in_contact);
      ASSERT_NEAR(dot(r3, axis), r1, 1e-7) << i;
      ASSERT_LT(norm(across(r3, axis)), 1e-7) << i;
      ASSERT_NEAR(dot(three.prompt_force_n(), axis), one.prompt_force_n(), 1e-7);
      ASSERT_NEAR(three.explained_by_jerk_n(), one.explained_by_jerk_n(), 1e-7);
      if (dice(random) == 0) {
        one.assume_free();
        three.assume_free();
      }
    }
  }
}

TEST(FreeMotionResidual3, AnImpactFromAnySideIsSeenWithinTwoTicks) {
  std::mt19937_64 random(5);
  for (int round = 0; round < 50; ++round) {
    const hal::Vector3 from = random_direction(random);
    const hal::Vector3 way = random_direction(random);
    FreeMotionResidual3 residual(kMassG, 1000.0);
    for (int i = 0; i < 200; ++i) residual.update({}, way * (0.1 * i), i * kPeriodNs, false);
    int seen_after = -1;
    for (int i = 200; i < 300 && seen_after < 0; ++i) {
      const double force = 0.06 * (i - 199);  // 60 N/s: a hard object
      if (norm(residual.update(from * force, way * (0.1 * i), i * kPeriodNs, false)) > 0.02) {
        seen_after = i - 200;
      }
    }
    EXPECT_GE(seen_after, 0);
    EXPECT_LE(seen_after, 2);
  }
}

}  // namespace
}  // namespace hapticd::rt
