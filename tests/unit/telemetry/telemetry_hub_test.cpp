#include "server/telemetry/telemetry_hub.h"

#include <gtest/gtest.h>

#include <atomic>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "rt/loop/engine.h"
#include "tests/support/still_rig.h"

namespace hapticd::server {
namespace {

using std::chrono::milliseconds;

/// Engine and hub driven by hand: no thread, no clock.
class TelemetryHubTest : public testing::Test {
 protected:
  explicit TelemetryHubTest(std::size_t ring = 8192) : engine_(rig_, ring), hub_(engine_) {}

  void tick(std::uint64_t count) {
    for (std::uint64_t i = 0; i < count; ++i) {
      hal::RigSample sample;
      sample.tick = next_tick_++;
      engine_.on_tick(sample);
    }
  }
  /// Ticks that are handed on at `now_`.
  void pass(std::uint64_t count) {
    tick(count);
    hub_.pump(now_);
  }
  static std::vector<std::uint64_t> ticks(const Subscription::Batch& batch) {
    std::vector<std::uint64_t> numbers;
    for (const auto& entry : batch.entries) numbers.push_back(entry.record().tick);
    return numbers;
  }

  test::StillRig rig_;
  rt::Engine engine_;
  TelemetryHub hub_;
  std::uint64_t next_tick_ = 0;
  Subscription::Clock::time_point now_{};
};

TEST_F(TelemetryHubTest, BatchesAreReadyWhenFullOrOld) {
  int calls = 0;
  SubscriptionOptions options;
  options.batch_size = 4;
  options.on_ready = [&calls] { ++calls; };
  const auto subscription = hub_.subscribe(options);
  Subscription::Batch batch;

  pass(3);
  EXPECT_EQ(calls, 0);
  EXPECT_FALSE(subscription->take(batch, now_));
  pass(2);
  EXPECT_EQ(calls, 1);
  ASSERT_TRUE(subscription->take(batch, now_));
  EXPECT_EQ(ticks(batch), (std::vector<std::uint64_t>{0, 1, 2, 3}));
  EXPECT_FALSE(subscription->take(batch, now_));

  hub_.pump(now_ + milliseconds(99));
  EXPECT_EQ(calls, 1);
  hub_.pump(now_ + milliseconds(100));
  EXPECT_EQ(calls, 2);
  ASSERT_TRUE(subscription->take(batch, now_ + milliseconds(100)));
  EXPECT_EQ(ticks(batch), (std::vector<std::uint64_t>{4}));
}

TEST_F(TelemetryHubTest, DecimationKeepsEveryNthTick) {
  SubscriptionOptions options;
  options.decimation = 10;
  options.batch_size = 3;
  const auto subscription = hub_.subscribe(options);
  next_tick_ = 5;
  pass(30);
  Subscription::Batch batch;
  ASSERT_TRUE(subscription->take(batch, now_));
  EXPECT_EQ(ticks(batch), (std::vector<std::uint64_t>{10, 20, 30}));
}

TEST_F(TelemetryHubTest, AStalledSubscriberLosesItsOwnOldestAndNoOneElses) {
  SubscriptionOptions slow;
  slow.queue_samples = 100;
  slow.batch_size = 100;
  const auto stalled = hub_.subscribe(slow);
  const auto reading = hub_.subscribe({});
  std::uint64_t expected = 0;
  Subscription::Batch batch;
  for (int round = 0; round < 50; ++round) {
    pass(20);
    while (reading->take(batch, now_)) {
      EXPECT_EQ(batch.dropped_by_subscriber, 0U);
      for (const std::uint64_t number : ticks(batch)) EXPECT_EQ(number, expected++);
    }
  }
  EXPECT_EQ(expected, 1000U);
  ASSERT_TRUE(stalled->take(batch, now_));
  EXPECT_EQ(batch.dropped_by_subscriber, 900U);
  EXPECT_EQ(ticks(batch).front(), 900U) << "what is left is the newest, without a gap in it";
  EXPECT_EQ(ticks(batch).size(), 100U);
  EXPECT_EQ(ticks(batch).back(), 999U);
}

TEST_F(TelemetryHubTest, ASampleIsHeldForAMinuteAtMost) {
  SubscriptionOptions slow;
  slow.queue_samples = 60000;
  slow.batch_size = 10;
  const auto stalled = hub_.subscribe(slow);
  for (int s = 0; s < 100; ++s) {
    tick(1);
    hub_.pump(now_ + std::chrono::seconds(s));
  }
  Subscription::Batch batch;
  ASSERT_TRUE(stalled->take(batch, now_ + std::chrono::seconds(100)));
  EXPECT_EQ(ticks(batch).front(), 39U);
  EXPECT_EQ(batch.dropped_by_subscriber, 39U);
}

// One sample in a hundred kept all records of a minute: at 10 kHz, 800 MB for one client that did not read.
TEST_F(TelemetryHubTest, ADecimatedSampleIsHeldForSixtyThousandTicksAtMost) {
  SubscriptionOptions slow;
  slow.decimation = 100;
  slow.queue_samples = 60000;
  slow.batch_size = 10;
  const auto stalled = hub_.subscribe(slow);
  for (int i = 0; i < 70; ++i) {
    pass(1000);
  }
  Subscription::Batch batch;
  ASSERT_TRUE(stalled->take(batch, now_));
  EXPECT_EQ(ticks(batch).front(), 10'000U);
  EXPECT_EQ(batch.dropped_by_subscriber, 100U);
}

TEST_F(TelemetryHubTest, ManySubscribersHoldLessEachButNoneOfTheDaemonsOwn) {
  SubscriptionOptions own;
  own.queue_samples = 4000;
  own.batch_size = 4000;
  own.is_own = true;
  const auto recorder = hub_.subscribe(own);
  SubscriptionOptions slow;
  slow.queue_samples = 60000;
  slow.batch_size = 2000;
  std::vector<std::shared_ptr<Subscription>> many;
  for (int i = 0; i < 499; ++i) many.push_back(hub_.subscribe(slow));
  pass(4000);
  Subscription::Batch batch;
  ASSERT_TRUE(many.front()->take(batch, now_));
  EXPECT_EQ(batch.entries.size(), Subscription::kMaxQueued / 500);
  EXPECT_EQ(batch.dropped_by_subscriber, 2000U);
  ASSERT_TRUE(recorder->take(batch, now_));
  EXPECT_EQ(batch.dropped_by_subscriber, 0U);
}

TEST_F(TelemetryHubTest, WhatIsEncodedIsKeptForThoseWhoKeepUp) {
  static int encoded = 0;
  encoded = 0;
  const auto encode = [](const rt::TickRecord& record, std::uint32_t) {
    ++encoded;
    return std::to_string(record.tick);
  };
  SubscriptionOptions options;
  options.batch_size = 2;
  const auto subscription = hub_.subscribe(options);
  pass(2);
  Subscription::Batch batch;
  ASSERT_TRUE(subscription->take(batch, now_));
  std::string text;
  for (int i = 0; i < 3; ++i) batch.entries[1].append_encoded(text, 7, encode);
  EXPECT_EQ(text, "111");
  EXPECT_EQ(encoded, 1);
  hub_.pump(now_ + std::chrono::seconds(1));
  for (int i = 0; i < 3; ++i) batch.entries[1].append_encoded(text, 7, encode);
  EXPECT_EQ(text, "111111");
  EXPECT_EQ(encoded, 4) << "no longer kept";
}

class SmallRing : public TelemetryHubTest {
 protected:
  SmallRing() : TelemetryHubTest(64) {}
};

TEST_F(SmallRing, WhatTheHubItselfMissesIsReportedToEverySubscriberSinceItsOwnBeginning) {
  tick(100);  // 36 lost before anybody subscribed
  hub_.pump(now_);
  SubscriptionOptions options;
  options.batch_size = 1;
  const auto subscription = hub_.subscribe(options);
  pass(80);
  Subscription::Batch batch;
  ASSERT_TRUE(subscription->take(batch, now_));
  EXPECT_EQ(batch.dropped_by_server, 16U);
  EXPECT_EQ(batch.dropped_by_subscriber, 0U);
  EXPECT_EQ(hub_.records_dropped(), 52U);
}

TEST_F(TelemetryHubTest, KeepsTheLastRecordAlsoWhenTheRingIsFull) {
  EXPECT_EQ(hub_.latest().tick, 0U);
  tick(10'000);
  EXPECT_EQ(hub_.latest().tick, 9999U);
  EXPECT_GT(hub_.records_dropped(), 0U);
}

TEST_F(TelemetryHubTest, OnlyItsOwnThreadCallsSubscribers) {
  std::atomic<int> calls{0};
  std::atomic<bool> by_another{false};
  const std::thread::id here = std::this_thread::get_id();
  SubscriptionOptions options;
  options.batch_size = 1;
  options.on_ready = [&] {
    ++calls;
    if (std::this_thread::get_id() == here) by_another = true;
  };
  hub_.start();
  const auto subscription = hub_.subscribe(options);
  tick(5);
  EXPECT_EQ(hub_.latest().tick, 4U);
  hub_.flush();
  EXPECT_GT(calls.load(), 0) << "what was there is handed out when flush() returns";
  EXPECT_FALSE(by_another);
  Subscription::Batch batch;
  ASSERT_TRUE(subscription->take(batch, Subscription::Clock::now()));
  EXPECT_EQ(ticks(batch), (std::vector<std::uint64_t>{0}));
  hub_.unsubscribe(subscription);
  hub_.stop();
}

TEST_F(TelemetryHubTest, ASubscriberThatTakesLongHoldsUpNoReader) {
  std::atomic<bool> called{false};
  std::atomic<bool> let_go{false};
  SubscriptionOptions options;
  options.batch_size = 1;
  options.on_ready = [&] {
    called = true;
    called.notify_all();
    let_go.wait(false);
  };
  hub_.start();
  const auto subscription = hub_.subscribe(options);
  tick(1);
  called.wait(false);
  tick(1);
  EXPECT_EQ(hub_.latest().tick, 1U);
  EXPECT_EQ(hub_.subscriber_count(), 1U);
  hub_.unsubscribe(subscription);
  let_go = true;
  let_go.notify_all();
  hub_.stop();
}

TEST_F(TelemetryHubTest, TheEndHandsOutWhatIsLeftAndIsReported) {
  const auto reported = std::make_shared<bool>(false);  // the hub ends after this
  SubscriptionOptions options;
  options.on_ready = [reported] { *reported = true; };
  const auto subscription = hub_.subscribe(options);
  tick(3);
  hub_.start();
  hub_.stop();
  EXPECT_TRUE(*reported);
  EXPECT_FALSE(subscription->ended());
  Subscription::Batch batch;
  ASSERT_TRUE(subscription->take(batch, Subscription::Clock::now()));
  EXPECT_EQ(ticks(batch), (std::vector<std::uint64_t>{0, 1, 2}));
  EXPECT_TRUE(subscription->ended());
  EXPECT_TRUE(hub_.subscribe({})->ended()) << "late subscribers find an end, not a silence";
}

TEST_F(TelemetryHubTest, WhoUnsubscribedIsCalledNoMore) {
  int calls = 0;
  SubscriptionOptions options;
  options.batch_size = 1;
  options.on_ready = [&calls] { ++calls; };
  const auto subscription = hub_.subscribe(options);
  EXPECT_EQ(hub_.subscriber_count(), 1U);
  hub_.unsubscribe(subscription);
  EXPECT_EQ(hub_.subscriber_count(), 0U);
  pass(10);
  EXPECT_EQ(calls, 0);
}

}  // namespace
}  // namespace hapticd::server
