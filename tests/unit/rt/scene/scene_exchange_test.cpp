#include <gtest/gtest.h>

#include <cmath>

#include "rt/scene/renderer.h"

namespace hapticd::rt {
namespace {

/// Wants one force, in contact or not.
class Constant final : public Pipeline {
 public:
  explicit Constant(double force_n, bool in_contact = true) : force_n_(force_n), in_contact_(in_contact) {}
  std::uint32_t channels() const noexcept override { return channel::kContact | channel::kTarget; }
  PipelineOutput evaluate(const hal::RigSample&) noexcept override {
    return {{0.0, 0.0, force_n_},
            in_contact_,
            std::abs(force_n_) >= kTraceN,
            0,
            {.in_contact = in_contact_, .is_evident = in_contact_}};
  }
  void fill_record(TickRecord& record) const noexcept override {
    record.in_contact = in_contact_;
    record.desired_force_n = force_n_;
  }
  void applied(const hal::Vector3& force_n) noexcept override { applied_n = force_n.z; }
  void reset() noexcept override { ++resets; }
  void set_target(const TargetLaw&, double) noexcept override {}

  void set(double force_n, bool in_contact) {
    force_n_ = force_n;
    in_contact_ = in_contact;
  }
  double applied_n = 0.0;
  int resets = 0;

 private:
  double force_n_;
  bool in_contact_;
};

GuardLimits wide() {
  return {.max_force_n = 10.0, .max_force_rate_n_per_s = 1e6, .max_power_w = 100.0};
}

class SceneExchange : public testing::Test {
 protected:
  double tick() {
    hal::RigSample sample;
    sample.tick = tick_++;
    sample.tip_position_mm = tip_mm_;
    TickRecord record;
    return renderer_.tick(sample, record).force_n.z;
  }
  double ticks(int count) {
    double force_n = 0.0;
    for (int i = 0; i < count; ++i) force_n = tick();
    return force_n;
  }

  Renderer renderer_{wide(), 1000.0};
  std::uint64_t tick_ = 0;
  hal::Vector3 tip_mm_;
};

// To a scene without a real object; what an object's scene hands over to another one is in its contact.
TEST_F(SceneExchange, HandsTheForceOverInTwentyMilliseconds) {
  Constant before(3.0);
  Constant after(1.0);
  renderer_.exchange(&before, wide());
  EXPECT_EQ(tick(), 3.0) << "nothing stood: nothing to hand over";
  EXPECT_EQ(renderer_.exchange(&after, wide()), &before);
  double last_n = 3.0;
  for (int i = 0; i < 20; ++i) {
    const double force_n = tick();
    EXPECT_LE(force_n, last_n);
    EXPECT_LT(last_n - force_n, 2.0 / 20 + 1e-9);
    EXPECT_EQ(after.applied_n, force_n) << "what the device is given, the one who wanted it";
    last_n = force_n;
  }
  EXPECT_NEAR(last_n, 1.0, 1e-9);
  EXPECT_EQ(tick(), 1.0);
}

TEST_F(SceneExchange, LetsTheForceOfTheFixtureFade) {
  AssistanceSpec fixed{.fixture = FixtureParameters{}};
  for (const bool has_next : {true, false}) {
    Constant before(0.0, true);
    Constant after(0.0, false);
    tip_mm_ = {};
    renderer_.exchange(&before, wide(), fixed);
    ticks(10);
    before.set(0.0, false);
    tip_mm_.z = 3.0;
    double last_n = ticks(300);
    const double stood_n = last_n;
    ASSERT_LT(stood_n, -1.0);
    renderer_.exchange(has_next ? &after : nullptr, wide());
    if (!has_next) {
      EXPECT_EQ(tick(), 0.0);
      continue;
    }
    for (int i = 0; i < 20; ++i) {
      const double force_n = tick();
      EXPECT_LE(force_n - last_n, -stood_n / 20 + 1e-9) << i;
      EXPECT_EQ(after.applied_n, 0.0) << "it is not the scene's";
      last_n = force_n;
    }
    EXPECT_EQ(last_n, 0.0);
  }
}

TEST_F(SceneExchange, AStopDuringTheHandOverIsWholeAndFinal) {
  Constant before(3.0);
  Constant after(0.0);
  renderer_.exchange(&before, wide());
  ticks(3);
  renderer_.exchange(&after, wide());
  ticks(5);
  renderer_.raise(GuardFault::kStopped);
  EXPECT_EQ(tick(), 0.0);
  GuardLimits at_once = wide();
  at_once.resume_ramp_s = 0.0;
  renderer_.exchange(&after, at_once);
  EXPECT_TRUE(renderer_.clear());
  EXPECT_EQ(ticks(100), 0.0) << "nothing of the old force comes back";
}

TEST_F(SceneExchange, IsFreeOnceNothingWasTouchedOrWantedForLongerThanAnyFade) {
  EXPECT_TRUE(renderer_.can_exchange_scene()) << "no scene";
  Constant scene(0.0, false);
  renderer_.exchange(&scene, wide());
  ticks(60);
  EXPECT_TRUE(renderer_.can_exchange_scene());
  scene.set(1.0, true);
  tick();
  EXPECT_FALSE(renderer_.can_exchange_scene());
  scene.set(0.5, false);  // released, but what was rendered is still fading
  ticks(200);
  EXPECT_FALSE(renderer_.can_exchange_scene());
  scene.set(0.0, true);  // in contact, at its turning point
  ticks(200);
  EXPECT_FALSE(renderer_.can_exchange_scene());
  scene.set(0.0, false);
  ticks(59);
  EXPECT_FALSE(renderer_.can_exchange_scene());
  tick();
  EXPECT_TRUE(renderer_.can_exchange_scene());
  scene.set(1.0, true);
  tick();
  renderer_.raise(GuardFault::kStopped);
  EXPECT_TRUE(renderer_.can_exchange_scene()) << "latched: there is no force to lose";
}

TEST_F(SceneExchange, AfterAFaultThePipelineStartsAgainWhereTheTableSaysSo) {
  for (const FaultRule& rule : kFaultTable) {
    Renderer renderer(wide(), 1000.0);
    Constant scene(3.0);
    renderer.exchange(&scene, wide());
    hal::RigSample sample;
    TickRecord record;
    for (int i = 0; i < 3; ++i) renderer.tick(sample, record = {});
    ASSERT_EQ(scene.resets, 1) << "when it was loaded";
    sample.status = rule.sample_status;
    if (rule.sample_status == 0) renderer.raise(rule.fault);
    renderer.tick(sample, record = {});
    sample.status = 0;
    for (int i = 0; i < 3; ++i) renderer.tick(sample, record = {});
    EXPECT_EQ(scene.resets, rule.restarts ? 2 : 1) << rule.name;
  }
}

TEST_F(SceneExchange, ALateTickIsNoHandOver) {
  Constant before(3.0);
  Constant after(1.0);
  renderer_.exchange(&before, wide());
  ticks(3);
  renderer_.exchange(&after, wide());
  hal::RigSample sample;
  TickRecord record;
  sample.time_ns = 1'000'000;
  renderer_.tick(sample, record);
  sample.time_ns += 18'000'000;  // of 20 ms
  const double force_n = renderer_.tick(sample, record).force_n.z;
  EXPECT_NEAR(force_n, 1.0 + 2.0 * (1.0 - 0.05 - 0.5), 1e-9) << "10 ms at most";
}

TEST_F(SceneExchange, NoNumberIsNoForceEvenWhileHandingOver) {
  Constant before(3.0);
  Constant after(std::nan(""));
  renderer_.exchange(&before, wide());
  ticks(3);
  renderer_.exchange(&after, wide());
  EXPECT_EQ(tick(), 0.0);
  EXPECT_EQ(renderer_.guard().fault(), GuardFault::kNonFinite);
}

}  // namespace
}  // namespace hapticd::rt
