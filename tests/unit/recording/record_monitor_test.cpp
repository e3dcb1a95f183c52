#include "server/recording/record_monitor.h"

#include <gtest/gtest.h>

namespace hapticd::server {
namespace {

using recording::EventKind;

rt::TickRecord record_at(std::uint64_t tick, rt::GuardState state = rt::GuardState::kRendering,
                         rt::GuardFault fault = rt::GuardFault::kNone) {
  rt::TickRecord record;
  record.tick = tick;
  record.time_ns = static_cast<std::int64_t>(tick) * 1'000'000;
  record.guard_state = state;
  record.guard_fault = fault;
  return record;
}

TEST(RecordMonitor, FaultsStopsAndTheirEndAreEvents) {
  RecordMonitor watch;
  EXPECT_TRUE(watch.look(record_at(0)).empty());
  const auto fault = watch.look(record_at(1, rt::GuardState::kLatched, rt::GuardFault::kSensorStale));
  ASSERT_EQ(fault.size(), 1U);
  EXPECT_EQ(fault[0].event.kind, EventKind::kFault);
  EXPECT_EQ(fault[0].event.tick, 1U);
  EXPECT_NE(fault[0].event.text.find("sensor_stale"), std::string::npos);
  EXPECT_TRUE(watch.look(record_at(2, rt::GuardState::kLatched, rt::GuardFault::kSensorStale)).empty());
  const auto cleared = watch.look(record_at(3, rt::GuardState::kResuming));
  ASSERT_EQ(cleared.size(), 1U);
  EXPECT_EQ(cleared[0].event.kind, EventKind::kCleared);
  const auto stop = watch.look(record_at(4, rt::GuardState::kLatched, rt::GuardFault::kStopped));
  ASSERT_EQ(stop.size(), 1U);
  EXPECT_EQ(stop[0].event.kind, EventKind::kStop);
}

TEST(RecordMonitor, AFaultThatIsOverWithinItsTickIsAnEvent) {
  RecordMonitor watch;
  rt::TickRecord record = record_at(0);
  EXPECT_TRUE(watch.look(record).empty());
  record = record_at(1);
  record.faults_present = 1U << static_cast<unsigned>(rt::GuardFault::kLoopGap);
  const auto found = watch.look(record);
  ASSERT_EQ(found.size(), 1U);
  EXPECT_EQ(found[0].fault, rt::GuardFault::kLoopGap);
  EXPECT_TRUE(found[0].ends_by_itself);
  EXPECT_TRUE(watch.look(record_at(2)).empty());
}

TEST(RecordMonitor, AnotherSceneIsAnEvent) {
  RecordMonitor watch;
  rt::TickRecord record = record_at(0);
  EXPECT_TRUE(watch.look(record).empty());
  record.scene_generation = 1;
  ASSERT_EQ(watch.look(record).size(), 1U);
  EXPECT_TRUE(watch.look(record).empty());
}

TEST(RecordMonitor, OverrunsAreOneEventAMinuteThatCountsThem) {
  RecordMonitor watch;
  std::size_t events = 0;
  for (std::uint64_t tick = 0; tick < 180'000; ++tick) {
    rt::TickRecord record = record_at(tick);
    if (tick % 10 == 0) record.timing.overrun = rt::OverrunCause::kCompute;
    const auto found = watch.look(record);
    events += found.size();
    if (tick == 60'000) {
      EXPECT_NE(found.at(0).event.text.find("(6000 since"), std::string::npos) << found.at(0).event.text;
    }
  }
  EXPECT_EQ(events, 3U);
}

}  // namespace
}  // namespace hapticd::server
