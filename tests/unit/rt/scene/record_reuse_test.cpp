#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstddef>
#include <functional>
#include <limits>
#include <new>

#include "explore_bench.h"
#include "pipeline_bench.h"

namespace hapticd::rt {
namespace {

/// A record in memory that was filled with one value before.
class RecordOn {
 public:
  explicit RecordOn(std::byte fill) {
    bytes_.fill(fill);
    record_ = new (bytes_.data()) TickRecord;
  }
  TickRecord& operator*() { return *record_; }
  TickRecord* operator->() { return record_; }
  const std::array<std::byte, sizeof(TickRecord)>& bytes() const { return bytes_; }

 private:
  alignas(TickRecord) std::array<std::byte, sizeof(TickRecord)> bytes_{};
  TickRecord* record_;
};

/// True if all members are alike, bit for bit; what is between them does not count.
bool alike(const RecordOn& a, const RecordOn& b) {
  static const RecordOn zeros(std::byte{0});
  static const RecordOn ones(std::byte{255});
  for (std::size_t i = 0; i < sizeof(TickRecord); ++i) {
    if (zeros.bytes()[i] == ones.bytes()[i] && a.bytes()[i] != b.bytes()[i]) return false;
  }
  return true;
}

/// Gives two renderers the same samples; one fills new records, the other one record over and over. On the
/// way a sample is unfit, the scene is stopped, the guide begins and the scene is exchanged for none and
/// back.
void expect_alike(const std::string& name, Renderer& with_new, Renderer& with_one, Pipeline* new_one,
                  Pipeline* old_one, const GuardLimits& limits,
                  const std::function<hal::RigSample(int)>& sample_at) {
  RecordOn kept(std::byte{0});
  int contacts = 0;
  int free = 0;
  for (int i = 0; i < 8000; ++i) {
    hal::RigSample sample = sample_at(i);
    sample.tick = static_cast<std::uint64_t>(i);
    sample.time_ns = 1'000'000 * static_cast<std::int64_t>(i);
    sample.angles.known = i % 1000 < 900;
    if (i == 3200) sample.tip_position_mm.x = std::numeric_limits<double>::quiet_NaN();
    Pipeline* const pipelines[] = {new_one, old_one};
    Renderer* const renderers[] = {&with_new, &with_one};
    for (std::size_t k = 0; k < 2; ++k) {
      if (i == 3210 || i == 5200) renderers[k]->clear();
      if (i == 5000) renderers[k]->raise(GuardFault::kStopped);
      if (i == 6000) renderers[k]->exchange(nullptr, limits);
      if (i == 6010) renderers[k]->exchange(pipelines[k], limits);
      if (i == 7000) renderers[k]->assistance().begin_guide({});
    }
    RecordOn fresh(std::byte{0});
    with_new.tick(sample, *fresh);
    with_one.tick(sample, *kept);
    ASSERT_TRUE(alike(fresh, kept)) << name << ", tick " << i;
    contacts += fresh->in_contact ? 1 : 0;
    free += fresh->in_contact ? 0 : 1;
  }
  EXPECT_GT(contacts, 500) << name;
  EXPECT_GT(free, 500) << name;
}

TEST(TickRecord, OneThatIsFilledAgainIsAsANewOne) {
  for (const SceneSpec& spec : test::all_explore_scenes()) {
    test::ExploreBench with_new(spec);
    test::ExploreBench with_one(spec);
    expect_alike(spec.name, with_new.renderer(), with_one.renderer(), &with_new.pipeline(),
                 &with_one.pipeline(), with_new.scene().guard, [&](int i) {
                   const double t = 0.004 * std::max(0, i - 400);
                   return with_new.at({6.0 * std::sin(1.7 * t), 0.0, 3.0 * std::cos(t)});
                 });
  }
}

TEST(TickRecord, OneThatIsFilledAgainIsAsANewOneOnALine) {
  SceneSpec wall;
  wall.kind = SceneKind::kWall;
  SceneSpec ball = wall;
  ball.wall_ball.emplace();
  for (const SceneSpec& spec : {SceneSpec{}, wall, ball}) {
    Bench with_new(spec);
    Bench with_one(spec);
    const bool is_wall = spec.kind == SceneKind::kWall;
    expect_alike(is_wall ? "wall" : "tap", with_new.renderer(), with_one.renderer(), &with_new.pipeline(),
                 &with_one.pipeline(), with_new.scene().guard, [&](int i) {
                   const double depth_mm = -3.0 * std::cos(0.004 * std::max(0, i - 400));
                   return with_new.at_depth(depth_mm, is_wall ? 0.0 : 0.5);
                 });
  }
}

/// A scene that fills a displacement, or says that it does.
class OneNumber final : public Pipeline {
 public:
  explicit OneNumber(double displacement_mm) : displacement_mm_(displacement_mm) {}
  std::uint32_t channels() const noexcept override { return channel::kDeformation; }
  PipelineOutput evaluate(const hal::RigSample& /*sample*/) noexcept override { return {}; }
  void fill_record(TickRecord& record) const noexcept override {
    if (displacement_mm_ > 0.0) record.displacement_mm = displacement_mm_;
  }
  void applied(const hal::Vector3& /*force_n*/) noexcept override {}
  void reset() noexcept override {}
  void set_target(const TargetLaw& /*target*/, double /*ramp_s*/) noexcept override {}

 private:
  double displacement_mm_;
};

TEST(TickRecord, HasNothingOfTheSceneBefore) {
  OneNumber before(3.0);
  OneNumber after(0.0);
  Bench bench;
  TickRecord record;
  bench.renderer().exchange(&before, bench.scene().guard);
  bench.renderer().tick({}, record);
  EXPECT_EQ(record.displacement_mm, 3.0);
  bench.renderer().exchange(&after, bench.scene().guard);
  bench.renderer().tick({}, record);
  EXPECT_EQ(record.displacement_mm, 0.0);
}

}  // namespace
}  // namespace hapticd::rt
