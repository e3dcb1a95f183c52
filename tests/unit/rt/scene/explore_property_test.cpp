#include <gtest/gtest.h>

#include <limits>

#include "explore_bench.h"

namespace hapticd::rt {
namespace {

using namespace test;

/// What may go wrong with a sample or around it. Each seed mixes them in its own shares.
class Mischief {
 public:
  explicit Mischief(std::uint64_t seed) : random_(seed) {
    std::uniform_int_distribution<int> severity(0, 60);
    for (int& s : per_mille_) s = severity(random_) > 30 ? severity(random_) : 0;
  }

  /// The hand's walk: random steps, jumps now and then, through the surface and out of it.
  hal::Vector3 walk() {
    velocity_ = velocity_ * 0.995 + random_vector(random_, 0.004);
    tip_ = tip_ + velocity_ + hal::Vector3{0.0, 0.0, -0.0005 * tip_.z};
    tip_ = tip_ * (norm(tip_) > 80.0 ? 0.99 : 1.0);
    if (chance(0)) tip_ = random_vector(random_, 20.0);
    return tip_;
  }
  hal::Quaternion orientation() {
    if (chance(1)) held_ = random_rotation(random_);
    return held_;
  }
  void spoil(hal::RigSample& sample) {
    if (chance(2)) (&sample.tip_position_mm.x)[pick(3)] = strange();
    if (chance(3)) (&sample.sensor_force_n.x)[pick(3)] = strange();
    if (chance(4)) sample.sensor_force_n = random_vector(random_, 3000.0);
    if (chance(5)) sample.status = static_cast<std::uint32_t>(pick(2048));
    if (chance(6)) sample.force_age_ns = pick(10) * 1'000'000;
    if (chance(7)) {
      const double by = chance(7) ? 0.0 : std::abs(random_vector(random_, 2.0).x);
      sample.tip_orientation = {by * sample.tip_orientation.w, by * sample.tip_orientation.x,
                                by * sample.tip_orientation.y, by * sample.tip_orientation.z};
    }
    if (chance(8)) (&sample.tip_orientation.w)[pick(4)] = std::numeric_limits<double>::quiet_NaN();
    if (chance(9)) sample.sensor_torque_n_mm.y = strange();
  }
  void disturb(ExploreBench& bench) {
    if (chance(10)) bench.set_time_ns(bench.time_ns() + pick(200) * 1'000'000);  // a gap
    if (chance(11)) bench.set_time_ns(bench.time_ns() - pick(50) * 1'000'000);   // backwards
    bench.set_period_ns(chance(12) ? pick(3) * 500'000 : 1'000'000);
    if (chance(13)) bench.renderer().raise(GuardFault::kStopped);
    if (pick(200) == 0) bench.renderer().clear();
    if (chance(14)) {
      TargetLaw law;
      law.kind = static_cast<TargetLaw::Kind>(pick(4));
      law.stiffness_n_per_mm = pick(1000);
      law.hunt_crossley = {0.01 * pick(300), 0.0005 * pick(11), 1.0 + 0.5 * pick(5)};
      law.knots[0] = {0.0, 0.1 * pick(100)};
      law.knots[1] = {4.0, 0.1 * pick(100)};
      law.knot_count = 2;
      ASSERT_FALSE(check(law, "mischief"));
      bench.renderer().set_target(law, 0.001 * pick(300));
    }
    if (chance(15)) {
      // 5e-324 and the like: denormal, but a number.
      bench.renderer().set_target(linear_target(5e-324), 0.0);
    }
  }

 private:
  bool chance(std::size_t kind) {
    return std::uniform_int_distribution<int>(0, 999)(random_) < per_mille_[kind];
  }
  int pick(int count) { return std::uniform_int_distribution<int>(0, count - 1)(random_); }
  double strange() {
    switch (pick(6)) {
      case 0:
        return std::numeric_limits<double>::quiet_NaN();
      case 1:
        return HUGE_VAL;
      case 2:
        return -HUGE_VAL;
      case 3:
        return 1e300;
      case 4:
        return 5e-324;
      default:
        return 9999.0;
    }
  }
  std::mt19937_64 random_;
  std::array<int, 16> per_mille_{};
  hal::Vector3 tip_{0.0, 0.0, 5.0};
  hal::Vector3 velocity_;
  hal::Quaternion held_;
};

/// A good while in the air, so that an object that recovers slowly is known to have recovered: 15 lags of
/// the slowest that the model has. An abnormal force of 3 kN counts as a mark that deep.
constexpr int kTicksToRecover = 20'000;

constexpr double kBackDriveN = 0.2;  // so that its compensation takes part

class ExploreProperty : public testing::TestWithParam<std::size_t> {
 protected:
  static SceneSpec spec() {
    SceneSpec scene = all_explore_scenes()[GetParam()];
    scene.target = linear_target(0.7);
    scene.guard.max_force_n = 6.0;
    return scene;
  }
};

TEST_P(ExploreProperty, WhateverComesTheCommandIsFiniteAndBoundedAndAfterwardsAllIsWell) {
  double fresh_n = 0.0;
  {
    ExploreBench bench(spec(), bench_model(), "phantom_1_5_high_force", kBackDriveN);
    bench.rest({0.0, 0.0, 10.0}, 100);
    const TickRecord record = bench.press_and_hold();
    ASSERT_TRUE(record.in_contact);
    fresh_n = record.device_command_n.z;
    ASSERT_GT(fresh_n, 0.5);
  }
  std::uint32_t contacts = 0;
  int latched = 0;
  for (std::uint64_t seed = 1; seed <= 25; ++seed) {
    ExploreBench bench(spec(), bench_model(), "phantom_1_5_high_force", kBackDriveN);
    const double limit = bench.scene().guard.max_force_n;
    const double change = bench.scene().guard.max_force_rate_n_per_s * 1e-3;
    Mischief mischief(seed);
    hal::Vector3 before;
    for (int i = 0; i < 4000; ++i) {
      mischief.disturb(bench);
      hal::RigSample sample = bench.at(mischief.walk(), mischief.orientation());
      mischief.spoil(sample);
      const TickRecord record = bench.tick(sample);
      const hal::Vector3& f = record.device_command_n;
      ASSERT_TRUE(finite(f)) << "seed " << seed << ", tick " << i;
      ASSERT_LE(norm(f), limit + 1e-9) << "seed " << seed << ", tick " << i;
      if (record.guard_state != GuardState::kLatched && record.guard_state != GuardState::kSuspended) {
        // Less by more than that only if magnitude or power ask for it.
        const bool is_bounded = (record.guard_limits & (guard_limit::kPower | guard_limit::kForce)) != 0;
        const double rise_n = is_bounded ? norm(f) - norm(before) : norm(f - before);
        ASSERT_LE(rise_n, change + 1e-9) << "seed " << seed << ", tick " << i;
      } else {
        ASSERT_EQ(norm(f), 0.0);
        ++latched;
      }
      before = f;
      contacts = std::max(contacts, record.contact_count);
    }
    bench.set_period_ns(1'000'000);
    bench.tremble();  // it has done so: one that does not any more is frozen
    bench.renderer().set_target(linear_target(0.7), 0.0);
    bench.rest({0.0, 0.0, 10.0}, 2);
    ASSERT_TRUE(bench.renderer().clear()) << "seed " << seed;
    bench.rest({0.0, 0.0, 10.0}, kTicksToRecover);
    const TickRecord record = bench.press_and_hold();
    ASSERT_TRUE(record.in_contact) << "seed " << seed;
    ASSERT_NEAR(record.device_command_n.z, fresh_n, 0.02) << "seed " << seed;
    ASSERT_LT(std::hypot(record.device_command_n.x, record.device_command_n.y), 0.02) << "seed " << seed;
  }
  EXPECT_GT(contacts, 5U) << "there were contacts, or this proves little";
  EXPECT_GT(latched, 1000) << "and faults";
}

std::string scene_name(const testing::TestParamInfo<std::size_t>& info) {
  const SceneSpec spec = all_explore_scenes()[info.param];
  return spec.name + (spec.contact.method == ContactMethod::kFilteredAcceleration ? "_as_published" : "");
}
INSTANTIATE_TEST_SUITE_P(Scenes, ExploreProperty, testing::Range<std::size_t>(0, 7), scene_name);

/// Samples with a bad orientation while the tool is free, all else in order; then a press, which must be
/// rendered.
TickRecord press_after(const hal::Quaternion& bad, int ticks) {
  SceneSpec spec = explore_scene(Tip::kRod);
  spec.target = linear_target(0.7);
  ExploreBench bench(spec);
  bench.rest({0.0, 0.0, 10.0}, 100);
  for (int i = 0; i < ticks; ++i) {
    hal::RigSample sample = bench.at({0.0, 0.0, 10.0});
    sample.tip_orientation = bad;
    bench.tick(sample);
  }
  bench.rest({0.0, 0.0, 10.0}, 2);
  bench.renderer().clear();
  bench.rest({0.0, 0.0, 10.0}, kTicksToRecover);
  return bench.press_and_hold();
}

// With numbers whose square overflows the reaction would be infinite and stay in the filters of the contact
// stage, which then sees no contact any more, without a word.
TEST(ExploreRecovery, FromAnOrientationThatIsNoRotation) {
  for (const hal::Quaternion& bad :
       {hal::Quaternion{0.0, 0.0, 0.0, 0.0}, hal::Quaternion{2.0, 0.0, 0.0, 0.0},
        hal::Quaternion{1.0, 1.0, 1.0, 1.0}, hal::Quaternion{0.0, 30.0, 0.0, 0.0},
        hal::Quaternion{std::nan(""), 0.0, 0.0, 0.0}, hal::Quaternion{0.0, 1e200, 0.0, 0.0},
        hal::Quaternion{1e200, 1.0, 0.0, 0.0}, hal::Quaternion{0.0, -1e200, 1e200, 1e200}}) {
    for (const int ticks : {1, 10}) {
      const TickRecord record = press_after(bad, ticks);
      EXPECT_TRUE(record.in_contact);
      EXPECT_GT(record.device_command_n.z, 0.5) << bad.w << ", " << bad.x << ", " << ticks << " ticks";
    }
  }
}

}  // namespace
}  // namespace hapticd::rt
