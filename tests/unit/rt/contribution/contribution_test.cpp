#include "rt/contribution/contribution.h"

#include <gtest/gtest.h>

#include "rt/scene/effects.h"
#include "rt/scene/explore_pipeline.h"
#include "tests/unit/rt/scene/explore_bench.h"

namespace hapticd::rt {
namespace {

using namespace test;

constexpr hal::Vector3 kForceN{0.0, 0.3, -0.2};

/// Gives the same force in every tick, and counts its calls.
class Constant final : public Contribution {
 public:
  struct Calls {
    int updates = 0;
    int resets = 0;
    int began = 0;
  };
  explicit Constant(Calls& calls) noexcept : calls_(calls) {}

  hal::Vector3 update(const ContactState& now) noexcept override {
    ++calls_.updates;
    calls_.began += now.began ? 1 : 0;
    return kForceN;
  }
  void reset() noexcept override { ++calls_.resets; }

 private:
  Calls& calls_;
};

/// Runs a scene with one more contribution next to the scene as it is, both closed by what they command.
class ContributionInAScene : public testing::Test {
 protected:
  void compose(Contributions::List Contributions::*joins) {
    const ObjectModel model = bench_model();
    Contributions more = contributions_of(bench_.scene(), model, bench_.info());
    (more.*joins).push_back(std::make_unique<Constant>(calls_));
    plain_.emplace(bench_.scene(), model, bench_.info(),
                   contributions_of(bench_.scene(), model, bench_.info()));
    changed_.emplace(bench_.scene(), model, bench_.info(), std::move(more));
  }
  /// Returns by how much the commands differ at the end.
  hal::Vector3 move(const hal::Vector3& from_mm, const hal::Vector3& to_mm, int ticks) {
    hal::Vector3 added_n;
    for (int i = 1; i <= ticks; ++i) {
      const double share = static_cast<double>(i) / ticks;
      hal::RigSample sample = bench_.at(from_mm + (to_mm - from_mm) * (share * share * (3.0 - 2.0 * share)));
      sample.time_ns = time_ns_ += 1'000'000;
      const hal::Vector3 plain_n = plain_->evaluate(sample).force_n;
      plain_->applied(plain_n);
      const hal::Vector3 changed_n = changed_->evaluate(sample).force_n;
      changed_->applied(changed_n);
      added_n = changed_n - plain_n;
    }
    return added_n;
  }
  hal::Vector3 approach() { return move({0.0, 0.0, 10.0}, {0.0, 0.0, 5.0}, 400); }
  hal::Vector3 press() {
    move({0.0, 0.0, 5.0}, {0.0, 0.0, -4.0}, 600);
    return move({0.0, 0.0, -4.0}, {0.0, 0.0, -4.0}, 500);
  }
  hal::Vector3 leave() {
    move({0.0, 0.0, -4.0}, {0.0, 0.0, 10.0}, 400);
    return move({0.0, 0.0, 10.0}, {0.0, 0.0, 10.0}, 100);
  }

  static SceneSpec scene() {
    SceneSpec spec = explore_scene(Tip::kRod);
    spec.structural_compensation = false;
    spec.explore.passivity = false;
    return spec;
  }

  ExploreBench bench_{scene()};
  Constant::Calls calls_;
  std::optional<ExplorePipeline> plain_;
  std::optional<ExplorePipeline> changed_;
  std::int64_t time_ns_ = 0;
};

TEST_F(ContributionInAScene, IsAskedOnceInEveryTickAndKnowsWhenAContactBegins) {
  compose(&Contributions::desired);
  approach();
  EXPECT_EQ(calls_.updates, 400) << "also in free air";
  press();
  leave();
  EXPECT_EQ(calls_.updates, 2000);
  EXPECT_EQ(calls_.began, 1);
  changed_->reset();
  EXPECT_EQ(calls_.resets, 1);
}

TEST_F(ContributionInAScene, GivesNothingWhereNothingIsTouchedAndAllOfItWhereAnObjectIsEvident) {
  compose(&Contributions::desired);
  EXPECT_EQ(norm(approach()), 0.0);
  EXPECT_LT(norm(press() - kForceN), 1e-6) << "the controller has settled";
  EXPECT_EQ(norm(leave()), 0.0);
}

TEST_F(ContributionInAScene, ADirectOneIsInTheCommandAsItIsAndTheControllerDoesNotSeeIt) {
  compose(&Contributions::direct);
  EXPECT_EQ(norm(approach()), 0.0);
  EXPECT_LT(norm(press() - kForceN), 1e-9);
  EXPECT_EQ(norm(leave()), 0.0) << "a command ends soon after the contact, whatever is in it";
}

}  // namespace
}  // namespace hapticd::rt
