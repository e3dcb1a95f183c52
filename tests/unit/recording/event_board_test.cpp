#include "server/recording/event_board.h"

#include <gtest/gtest.h>

#include "server/recording/guard_watch.h"
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

TEST(EventBoard, ManyTargetsDriveOutNoFault) {
  EventBoard board;
  board.add(event_of(EventKind::kFault, "the only one"));
  for (int i = 0; i < 20'000; ++i) board.add(event_of(EventKind::kTarget, std::to_string(i)));
  const auto all = board.all_after(0);
  ASSERT_EQ(all.size(), 1 + EventBoard::kKeptOfFrequent);
  EXPECT_EQ(all.front().number, 1U);
  EXPECT_EQ(all.front().event.text, "the only one");
  EXPECT_EQ(all.back().number, 20'001U);
  for (std::size_t i = 1; i < all.size(); ++i) ASSERT_GT(all[i].number, all[i - 1].number);
  std::uint64_t number = 0;
  std::uint64_t missed = 0;
  EXPECT_EQ(board.after(number, missed).size(), all.size());
  EXPECT_EQ(number, board.last());
  EXPECT_EQ(missed, 20'001U - all.size());
}

TEST(EventBoard, WhatIsInTheRecordsIsForThoseWhoWatchOnly) {
  EventBoard board;
  board.add(event_of(EventKind::kStop, "by a call"));
  board.add_from_records(event_of(EventKind::kStop, "in the records"));
  board.add(event_of(EventKind::kCommand, "clear"));
  std::uint64_t number = 0;
  std::uint64_t missed = 0;
  const auto recorded = board.after(number, missed);
  ASSERT_EQ(recorded.size(), 2U);
  EXPECT_EQ(recorded[0].text, "by a call");
  EXPECT_EQ(recorded[1].text, "clear");
  EXPECT_EQ(missed, 0U);
  EXPECT_EQ(board.all_after(0).size(), 3U);
  EXPECT_EQ(board.all_after(2).size(), 1U);
  EXPECT_TRUE(board.all_after(3).empty());
  EXPECT_TRUE(board.all_after(99).empty());
}

TEST(EventBoard, AWaitEndsWithTheNextEventAndForGood) {
  EventBoard board;
  EXPECT_TRUE(board.await_after(0, std::chrono::milliseconds(1))) << "nothing came";
  std::thread adds([&] { board.add(event_of(EventKind::kCommand, "x")); });
  while (board.all_after(0).empty()) EXPECT_TRUE(board.await_after(0, std::chrono::hours(1)));
  adds.join();
  std::thread ends([&] { board.end(); });
  while (board.await_after(1, std::chrono::hours(1))) {
  }
  ends.join();
}

class GuardWatchTest : public RecordingTest {};

TEST_F(GuardWatchTest, FaultsAndWhatClearedThemAreOnTheBoardWithTheTimeOfDay) {
  GuardWatch watch(hub_, board_);
  watch.start();
  tick(20);
  engine_.raise(rt::GuardFault::kOscillation);
  tick(20);
  ASSERT_TRUE(test::eventually([&] { return board_.last() > 0; }));
  const auto all = board_.all_after(0);
  ASSERT_EQ(all.size(), 1U);
  EXPECT_EQ(all[0].event.kind, EventKind::kFault);
  EXPECT_NE(all[0].event.text.find("oscillation: "), std::string::npos) << all[0].event.text;
  EXPECT_GT(all[0].event.unix_ns, 0);
  EXPECT_TRUE(all[0].is_in_records);
}

}  // namespace
}  // namespace hapticd::server
