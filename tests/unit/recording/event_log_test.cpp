#include "server/recording/event_log.h"

#include <gtest/gtest.h>

#include "server/recording/guard_monitor.h"
#include "tests/unit/recording/recording_fixture.h"

namespace hapticd::server {
namespace {

using recording::EventKind;

recording::Event event_of(EventKind kind, std::string text) {
  recording::Event event;
  event.kind = kind;
  event.text = std::move(text);
  return event;
}

TEST(EventLog, ManyTargetsDriveOutNoFault) {
  EventLog event_log;
  event_log.add(event_of(EventKind::kFault, "the only one"));
  for (int i = 0; i < 20'000; ++i) event_log.add(event_of(EventKind::kTarget, std::to_string(i)));
  const auto all = event_log.all_after(0);
  ASSERT_EQ(all.size(), 1 + EventLog::kKeptOfFrequent);
  EXPECT_EQ(all.front().number, 1U);
  EXPECT_EQ(all.front().event.text, "the only one");
  EXPECT_EQ(all.back().number, 20'001U);
  for (std::size_t i = 1; i < all.size(); ++i) ASSERT_GT(all[i].number, all[i - 1].number);
  std::uint64_t number = 0;
  std::uint64_t missed = 0;
  EXPECT_EQ(event_log.after(number, missed).size(), all.size());
  EXPECT_EQ(number, event_log.last());
  EXPECT_EQ(missed, 20'001U - all.size());
}

TEST(EventLog, WhatIsInTheRecordsIsForThoseWhoWatchOnly) {
  EventLog event_log;
  event_log.add(event_of(EventKind::kStop, "by a call"));
  event_log.add_from_records(event_of(EventKind::kStop, "in the records"));
  event_log.add(event_of(EventKind::kCommand, "clear"));
  std::uint64_t number = 0;
  std::uint64_t missed = 0;
  const auto recorded = event_log.after(number, missed);
  ASSERT_EQ(recorded.size(), 2U);
  EXPECT_EQ(recorded[0].text, "by a call");
  EXPECT_EQ(recorded[1].text, "clear");
  EXPECT_EQ(missed, 0U);
  EXPECT_EQ(event_log.all_after(0).size(), 3U);
  EXPECT_EQ(event_log.all_after(2).size(), 1U);
  EXPECT_TRUE(event_log.all_after(3).empty());
  EXPECT_TRUE(event_log.all_after(99).empty());
}

TEST(EventLog, AWaitEndsWithTheNextEventAndForGood) {
  EventLog event_log;
  EXPECT_TRUE(event_log.await_after(0, std::chrono::milliseconds(1))) << "nothing came";
  std::thread adds([&] { event_log.add(event_of(EventKind::kCommand, "x")); });
  while (event_log.all_after(0).empty()) EXPECT_TRUE(event_log.await_after(0, std::chrono::hours(1)));
  adds.join();
  std::thread ends([&] { event_log.end(); });
  while (event_log.await_after(1, std::chrono::hours(1))) {
  }
  ends.join();
}

class GuardMonitorTest : public RecordingTest {};

TEST_F(GuardMonitorTest, FaultsAndWhatClearedThemAreOnTheBoardWithTheTimeOfDay) {
  GuardMonitor watch(hub_, event_log_);
  watch.start();
  tick(20);
  engine_.raise(rt::GuardFault::kOscillation);
  tick(20);
  ASSERT_TRUE(test::eventually([&] { return event_log_.last() > 0; }));
  const auto all = event_log_.all_after(0);
  ASSERT_EQ(all.size(), 1U);
  EXPECT_EQ(all[0].event.kind, EventKind::kFault);
  EXPECT_NE(all[0].event.text.find("oscillation: "), std::string::npos) << all[0].event.text;
  EXPECT_GT(all[0].event.unix_ns, 0);
  EXPECT_TRUE(all[0].is_in_records);
}

}  // namespace
}  // namespace hapticd::server
