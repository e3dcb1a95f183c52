#include "server/pose/contact_follower.h"

#include <gtest/gtest.h>

#include "tests/unit/pose/milliseconds.h"

namespace hapticd::pose {
namespace {

class ContactEvents : public testing::Test {
 protected:
  rt::TickRecord tick(std::int64_t ms) {
    rt::TickRecord record;
    record.channels = rt::channel::kContact;
    record.scene_generation = 1;
    record.time_ns = ms * kMs;
    path_.follow({0.1 * static_cast<double>(ms), 0.0, 0.0}, record.time_ns);
    return record;
  }
  rt::TickRecord touching(std::int64_t ms, std::uint32_t number, std::int64_t began_ms) {
    rt::TickRecord record = tick(ms);
    record.in_contact = true;
    record.contact_count = number;
    record.contact_onset = {began_ms * kMs, (began_ms - 1) * kMs, (began_ms + 1) * kMs};
    return record;
  }
  TipMotion path_;
  ContactFollower events_;
};

TEST_F(ContactEvents, ATouchIsStampedWhenItBeganAndWhereTheTipWasThen) {
  for (int ms = 0; ms < 60; ++ms) events_.follow(tick(ms), path_);
  EXPECT_FALSE(events_.event());
  events_.follow(touching(60, 1, 48), path_);
  ASSERT_TRUE(events_.event());
  EXPECT_EQ(events_.event()->number, 1U);
  EXPECT_EQ(events_.event()->began.time_ns, 48 * kMs);
  EXPECT_EQ(events_.event()->declared_ns, 60 * kMs);
  ASSERT_TRUE(events_.event()->tip_known);
  EXPECT_NEAR(events_.event()->tip_mm.x(), 4.8, 1e-9);
  EXPECT_FALSE(events_.event()->ended_ns);
}

TEST_F(ContactEvents, StaysTheLastOneUntilTheNextBegins) {
  events_.follow(tick(0), path_);
  events_.follow(touching(10, 1, 5), path_);
  rt::TickRecord free = tick(20);
  free.contact_count = 1;
  events_.follow(free, path_);
  events_.follow(tick(21), path_);
  ASSERT_TRUE(events_.event());
  EXPECT_EQ(events_.event()->ended_ns, 20 * kMs);
  EXPECT_FALSE(events_.event()->withdrawn);
  events_.follow(touching(30, 2, 28), path_);
  EXPECT_EQ(events_.event()->number, 2U);
  EXPECT_FALSE(events_.event()->ended_ns);
}

TEST_F(ContactEvents, WhatWasNotFollowedHasNoInstants) {
  events_.follow(touching(1000, 3, 400), path_);
  ASSERT_TRUE(events_.event());
  EXPECT_EQ(events_.event()->began.time_ns, 400 * kMs);
  EXPECT_FALSE(events_.event()->declared_ns);
  rt::TickRecord free = tick(2000);
  free.contact_count = 3;
  events_.follow(free, path_);
  EXPECT_FALSE(events_.event()->ended_ns);
  events_.follow(touching(3000, 4, 2500), path_);
  EXPECT_EQ(events_.event()->number, 4U);
  EXPECT_FALSE(events_.event()->declared_ns);
}

TEST_F(ContactEvents, WhatWasNoObjectIsWithdrawn) {
  events_.follow(tick(0), path_);
  events_.follow(touching(10, 1, 5), path_);
  rt::TickRecord free = tick(20);
  free.contact_count = 1;
  free.withdrawn_count = 1;
  events_.follow(free, path_);
  EXPECT_TRUE(events_.event()->withdrawn);
}

TEST_F(ContactEvents, AContactBetweenTwoRecordsIsNotTakenForTheOneBefore) {
  events_.follow(touching(10, 1, 5), path_);
  events_.follow(touching(11, 2, 11), path_);  // released and touched again in a record that was lost
  EXPECT_EQ(events_.event()->number, 2U);
}

TEST_F(ContactEvents, WhereNothingIsKnownForAMomentTheLastOneStays) {
  events_.follow(tick(0), path_);
  events_.follow(touching(10, 1, 5), path_);
  rt::TickRecord unfit = tick(12);
  unfit.channels = 0;
  events_.follow(unfit, path_);
  ASSERT_TRUE(events_.event());
  EXPECT_EQ(events_.event()->number, 1U);
  EXPECT_EQ(events_.event()->ended_ns, 12 * kMs);
}

TEST_F(ContactEvents, AnotherSceneBeginsWithoutOne) {
  events_.follow(touching(10, 3, 5), path_);
  rt::TickRecord other = tick(11);
  other.scene_generation = 2;
  events_.follow(other, path_);
  EXPECT_FALSE(events_.event());
}

}  // namespace
}  // namespace hapticd::pose
