#include "server/access/call_quota.h"

#include <gtest/gtest.h>

#include <chrono>
#include <memory>
#include <string>
#include <thread>
#include <vector>

namespace hapticd::server {
namespace {

using namespace std::chrono_literals;

class CallQuotaOfThree : public testing::Test {
 protected:
  std::string limit_of(const std::string& identity) {
    const auto place = quota.take(identity, now);
    return place ? "" : place.refusal().error.limit;
  }
  CallQuota quota{3, 10.0};
  CallQuota::Clock::time_point now{1h};
};

TEST_F(CallQuotaOfThree, APlaceIsGivenBackWithItsLastCopy) {
  std::vector<CallQuota::Place> places;
  for (int i = 0; i < 3; ++i) places.push_back(*quota.take("anna", now));
  EXPECT_EQ(limit_of("anna"), "access.max_calls = 3");
  EXPECT_EQ(limit_of("ben"), "") << "of each identity";
  CallQuota::Place copy = places.back();
  places.pop_back();
  EXPECT_NE(limit_of("anna"), "");
  copy.reset();
  EXPECT_EQ(limit_of("anna"), "");
}

TEST_F(CallQuotaOfThree, CallsASecondAreLimitedAndComeBack) {
  for (int i = 0; i < 10; ++i) EXPECT_EQ(limit_of("anna"), "") << i;
  EXPECT_EQ(limit_of("anna"), "access.max_calls_per_s = 10");
  now += 50ms;
  EXPECT_NE(limit_of("anna"), "") << "half a call";
  now += 60ms;
  EXPECT_EQ(limit_of("anna"), "");
  now += 1h;
  for (int i = 0; i < 10; ++i) EXPECT_EQ(limit_of("anna"), "") << i;
  EXPECT_NE(limit_of("anna"), "") << "an hour of silence is worth a second";
}

TEST_F(CallQuotaOfThree, AClockThatRunsBackwardsGivesNothing) {
  for (int i = 0; i < 10; ++i) EXPECT_EQ(limit_of("anna"), "");
  now -= 10s;
  EXPECT_NE(limit_of("anna"), "");
  now += 10s;
  EXPECT_NE(limit_of("anna"), "");
}

TEST_F(CallQuotaOfThree, APlaceMayOutliveTheQuota) {
  auto own = std::make_unique<CallQuota>(3, 10.0);
  CallQuota::Place place = *own->take("anna", now);
  own.reset();
  place.reset();
}

TEST_F(CallQuotaOfThree, ManyIdentitiesAreForgottenOnceIdle) {
  CallQuota::Place kept = *quota.take("kept", now);
  for (int i = 0; i < 5000; ++i) {
    now += 1ms;
    EXPECT_EQ(limit_of(std::to_string(i)), "");
  }
  CallQuota::Place second = *quota.take("kept", now);
  CallQuota::Place third = *quota.take("kept", now);
  EXPECT_NE(limit_of("kept"), "") << "calls under way are not forgotten";
}

TEST(CallQuotaThreads, CountsFromAllThreads) {
  CallQuota quota(4, 1e9);
  std::vector<std::thread> threads;
  for (int i = 0; i < 4; ++i) {
    threads.emplace_back([&] {
      for (int n = 0; n < 2000; ++n) EXPECT_TRUE(quota.take("anna", CallQuota::Clock::now()));
    });
  }
  for (std::thread& thread : threads) thread.join();
}

}  // namespace
}  // namespace hapticd::server
