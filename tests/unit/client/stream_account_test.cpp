#include "client/cpp/stream_account.h"

#include <gtest/gtest.h>

namespace hapticd::client {
namespace {

TEST(StreamAccount, AStreamWithoutGapsIsComplete) {
  StreamAccount account;
  for (std::uint64_t tick = 1000; tick < 2000; ++tick) EXPECT_EQ(account.add(tick), 0U);
  EXPECT_EQ(account.samples(), 1000U);
  EXPECT_TRUE(account.complete());
}

TEST(StreamAccount, CountsGapsAndWhatIsMissingInThem) {
  StreamAccount account(1);
  account.add(10);
  EXPECT_EQ(account.add(12), 1U);
  EXPECT_EQ(account.add(13), 0U);
  EXPECT_EQ(account.add(20), 6U);
  EXPECT_EQ(account.gaps(), 2U);
  EXPECT_EQ(account.missing(), 7U);
  EXPECT_EQ(account.samples(), 4U);
  EXPECT_FALSE(account.complete());
}

TEST(StreamAccount, DecimationIsNoGap) {
  StreamAccount account(10);
  for (std::uint64_t tick = 7; tick < 1007; tick += 10) account.add(tick);
  EXPECT_TRUE(account.complete());
  EXPECT_EQ(account.add(1027), 2U);  // 1007 and 1017 are missing
  EXPECT_EQ(account.missing(), 2U);
}

TEST(StreamAccount, AStepThatIsNoMultipleOfTheDecimationHidesASample) {
  StreamAccount account(10);
  account.add(0);
  EXPECT_EQ(account.add(15), 1U);
  EXPECT_EQ(account.gaps(), 1U);
}

TEST(StreamAccount, RepeatedOrEarlierTicksAreDisorder) {
  StreamAccount account(2);
  account.add(10);
  account.add(10);
  account.add(8);
  account.add(11);
  EXPECT_EQ(account.disordered(), 3U);
  EXPECT_EQ(account.gaps(), 0U);
  EXPECT_FALSE(account.complete());
}

TEST(StreamAccount, TakesTheDaemonsCountsOfDrops) {
  StreamAccount account;
  account.add(1);
  account.set_dropped(0, 0);
  EXPECT_TRUE(account.complete());
  account.set_dropped(3, 1);
  EXPECT_EQ(account.dropped_by_subscriber(), 3U);
  EXPECT_EQ(account.dropped_by_server(), 1U);
  EXPECT_FALSE(account.complete());
}

TEST(StreamAccount, DecimationZeroCountsAsOne) {
  StreamAccount account(0);
  account.add(1);
  EXPECT_EQ(account.add(2), 0U);
  EXPECT_EQ(account.add(4), 1U);
}

}  // namespace
}  // namespace hapticd::client
