#include "server/scene/scene_cost.h"

#include <gtest/gtest.h>

#include <cmath>

#include "hal/sim/simulated_rig.h"
#include "rt/scene/compose.h"
#include "server/model/store/model_library.h"
#include "server/scene/scene_library.h"
#include "tests/support/value_of.h"

namespace hapticd::server {
namespace {

TEST(SceneCost, IsMeasuredInAndOutOfContactForEveryBuiltInScene) {
  const auto rig = test::value_of(sim::SimulatedRig::create({}));
  const hal::RigInfo& info = rig->info();
  const SceneLibrary scenes;
  for (const auto& entry : scenes.list()) {
    const auto resolved = test::value_of(rt::resolve(*scenes.find(entry.name), info));
    const auto model = ModelLibrary().find(resolved.object_model);
    const auto pipeline = test::value_of(rt::compose(resolved, info, model ? &*model : nullptr));
    const SceneCost cost = measure_cost(*pipeline, resolved, info);
    EXPECT_TRUE(std::isfinite(cost.median_ns) && std::isfinite(cost.p999_ns)) << entry.name;
    EXPECT_GT(cost.p999_ns, 0.0) << entry.name;
    EXPECT_LE(cost.median_ns, cost.p999_ns) << entry.name;
    EXPECT_GT(cost.ticks, 0U) << entry.name;
    if (cost.ticks == 5000U) {  // not cut short on a machine that had no time
      const auto at = cost.remark.find("samples: ");
      ASSERT_NE(at, std::string::npos) << cost.remark;
      const int in_contact = std::stoi(cost.remark.substr(at + 9));
      EXPECT_GT(in_contact, 2500) << entry.name << ": most of the time";
      EXPECT_LT(in_contact, 5000) << entry.name << ": but not all of it";
    }
  }
}

}  // namespace
}  // namespace hapticd::server
