// The effect of docs/tutorial_effect.md.
#include "tests/unit/rt/contribution/viscous_damper.h"

#include <gtest/gtest.h>

#include "rt/scene/effects.h"
#include "rt/scene/explore_pipeline.h"
#include "tests/unit/rt/scene/explore_bench.h"

namespace hapticd::rt {
namespace {

using namespace test;

constexpr double kDampingNsPerMm = 0.004;

/// Feeds the same samples to a scene with a damper and to one without; what they command changes nothing.
class ViscousDamperInAScene : public testing::Test {
 protected:
  ViscousDamperInAScene() : bench_(scene()), plain_(made(false)), damped_(made(true)) {}

  static SceneSpec scene() {
    SceneSpec spec = explore_scene(Tip::kRod);
    spec.structural_compensation = false;
    spec.explore.passivity = false;
    spec.target = linear_target(0.7);
    return spec;
  }
  ExplorePipeline made(bool with_damper) {
    const ObjectModel model = bench_model();
    Contributions contributions = contributions_of(bench_.scene(), model, bench_.info());
    if (with_damper) contributions.desired.push_back(std::make_unique<ViscousDamper>(kDampingNsPerMm));
    return ExplorePipeline(bench_.scene(), model, bench_.info(), std::move(contributions));
  }
  /// Moves both tips, and returns the largest difference of the forces between them.
  double move(const hal::Vector3& from_mm, const hal::Vector3& to_mm, int ticks) {
    double largest = 0.0;
    for (int i = 1; i <= ticks; ++i) {
      const double share = static_cast<double>(i) / ticks;
      hal::RigSample sample = bench_.at(from_mm + (to_mm - from_mm) * (share * share * (3.0 - 2.0 * share)));
      sample.time_ns = time_ns_ += 1'000'000;
      TickRecord plain;
      TickRecord damped;
      plain_.evaluate(sample);
      plain_.fill_record(plain);
      damped_.evaluate(sample);
      damped_.fill_record(damped);
      const double added_n = damped.desired_force_n - plain.desired_force_n;  // into the object
      const double expected_n = -kDampingNsPerMm * damped.velocity_mm_per_s * damped.contact_authority;
      if (damped.in_contact) {
        EXPECT_NEAR(added_n, expected_n, 1e-12) << "at " << time_ns_ << " ns";
      }
      largest = std::max(largest, std::abs(added_n));
    }
    return largest;
  }

  ExploreBench bench_;
  ExplorePipeline plain_;
  ExplorePipeline damped_;
  std::int64_t time_ns_ = 0;
};

TEST_F(ViscousDamperInAScene, DampsTheTipAsFarAsItsContactIsEvident) {
  EXPECT_EQ(move({0.0, 0.0, 10.0}, {0.0, 0.0, 5.0}, 400), 0.0) << "nothing there, nothing felt";
  move({0.0, 0.0, 5.0}, {0.0, 0.0, -4.0}, 600);
  const double pressing_n = move({0.0, 0.0, -4.0}, {0.0, 0.0, -7.0}, 150);
  EXPECT_NEAR(pressing_n, kDampingNsPerMm * 30.0, 0.01) << "1.5 times the mean of 20 mm/s";
  move({0.0, 0.0, -7.0}, {0.0, 0.0, -7.0}, 100);
  EXPECT_LT(move({0.0, 0.0, -7.0}, {0.0, 0.0, -7.0}, 200), 1e-3) << "a tip at rest is not damped";
  move({0.0, 0.0, -7.0}, {0.0, 0.0, 10.0}, 400);
  EXPECT_EQ(move({0.0, 0.0, 10.0}, {0.0, 0.0, 15.0}, 300), 0.0);
}

}  // namespace
}  // namespace hapticd::rt
