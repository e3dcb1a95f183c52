// Force only until a time: what the loop itself does about an endpoint that is missing.

#include <gtest/gtest.h>

#include <limits>

#include "rt/loop/engine.h"
#include "tests/unit/rt/loop/fake_rig.h"

namespace hapticd::rt {
namespace {

class EnginePermit : public testing::Test {
 protected:
  TickRecord tick() {
    rig.tick(engine);
    TickRecord record;
    engine.pop_record(record);
    return record;
  }

  FakeRig rig;
  Engine engine{rig};
};

TEST_F(EnginePermit, EndsAtTheFirstTickAfterItsTime) {
  engine.set_permit_until(5'000'000);
  for (int i = 0; i <= 5; ++i) ASSERT_EQ(tick().guard_state, GuardState::kRendering) << i;
  const TickRecord over = tick();
  EXPECT_EQ(over.guard_state, GuardState::kLatched);
  EXPECT_EQ(over.guard_fault, GuardFault::kEndpointMissing);
  engine.set_permit_until(1'000'000'000);
  const TickRecord later = tick();
  EXPECT_EQ(later.guard_state, GuardState::kLatched) << "until someone clears";
  EXPECT_EQ(later.faults_present, 0U);
}

TEST_F(EnginePermit, BearsAnyTime) {
  engine.set_permit_until(std::numeric_limits<std::int64_t>::min());
  EXPECT_EQ(tick().guard_fault, GuardFault::kEndpointMissing);
  engine.set_permit_until(std::numeric_limits<std::int64_t>::max());
  EXPECT_EQ(tick().faults_present, 0U);
}

}  // namespace
}  // namespace hapticd::rt
