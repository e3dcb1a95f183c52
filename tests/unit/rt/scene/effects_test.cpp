#include "rt/scene/effects.h"

#include <gtest/gtest.h>

#include "explore_bench.h"

namespace hapticd::rt {
namespace {

using namespace test;

std::uint32_t channels_of_all() {
  std::uint32_t all = 0;
  for (const Effect& effect : effects()) all |= effect.channels;
  return all;
}

TEST(Effects, ASceneHasThoseThatItAsksForAndNoOthers) {
  const hal::RigInfo rig = bench_rig();
  SceneSpec bare = explore_scene(Tip::kRod);
  bare.explore.passivity = false;
  const Contributions none = contributions_of(bare, bench_model(), rig);
  EXPECT_TRUE(none.desired.empty());
  EXPECT_TRUE(none.direct.empty());
  EXPECT_EQ(none.channels, 0U);

  SceneSpec full = *resolve(explore_scene(Tip::kRod), rig);
  full.inclusions.emplace_back();
  full.friction_target.emplace().scale = 1.5;
  full.transient.emplace().target = {{100.0, 80.0, 15.0}};
  const Contributions all = contributions_of(full, bench_model(), rig);
  EXPECT_EQ(all.desired.size(), 3U);
  EXPECT_EQ(all.direct.size(), 1U) << "the transient, which the controller would smear";
  EXPECT_EQ(all.channels, channels_of_all());
}

TEST(Effects, WhatASceneAnnouncesIsWhatItsPipelineFills) {
  std::vector<SceneSpec> scenes = all_explore_scenes();
  scenes.push_back(explore_scene(Tip::kRod));
  scenes.back().explore.passivity = false;
  const std::uint32_t of_every_scene = channel::kSample | channel::kGuard | channel::kTiming;
  for (const SceneSpec& spec : scenes) {
    ExploreBench bench(spec);
    EXPECT_EQ(outline(bench.scene()).channels, bench.pipeline().channels() | of_every_scene) << spec.name;
  }
}

TEST(Effects, ASceneThatDoesNotExploreIsRefusedItsEffectsByName) {
  SceneSpec tap;
  tap.name = "tap";
  tap.transient.emplace().target = {{100.0, 80.0, 15.0}};
  const auto pipeline = compose(*resolve(tap, bench_rig()), bench_rig());
  ASSERT_FALSE(pipeline);
  EXPECT_NE(pipeline.error().text().find("only scenes that explore have a transient"), std::string::npos);
}

}  // namespace
}  // namespace hapticd::rt
