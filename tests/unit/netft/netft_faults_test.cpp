// What a network and a box can do to a stream.

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "netft_bench.h"

namespace hapticd::netft {
namespace {

namespace status = hal::sample_status;

constexpr std::uint16_t kStartRequest = 0x02;

/// An engaged sensor.
template <class Bench>
class Engaged : public testing::Test {
 protected:
  void SetUp() override { ASSERT_FALSE(bench.engage()); }
  Bench bench;
};
using NetFtFaults = Engaged<NetFtBench>;
using NetFtFedFaults = Engaged<FedBench>;

TEST_F(NetFtFedFaults, LostDuplicateAndOvertakenSamplesAreCountedAndLeaveTheMeanOfTheRest) {
  const auto expect_mean = [this](std::uint32_t count, double force_n) {
    const hal::RigSample sample = bench.read();
    EXPECT_EQ(sample.force_count, count);
    EXPECT_NEAR(sample.sensor_force_n.x, force_n, 1e-6);
  };
  bench.feed({1.0, 0.0, 0.0});
  bench.box.drop_next(3);
  for (int i = 0; i < 3; ++i) bench.box.feed({100.0, 0.0, 0.0}, {});
  bench.feed({3.0, 0.0, 0.0});
  expect_mean(2, 2.0);
  EXPECT_EQ(bench.figure("sequence_gaps"), 1.0);
  EXPECT_EQ(bench.figure("samples_lost"), 3.0);

  bench.box.duplicate_next(1);
  bench.feed({4.0, 0.0, 0.0});
  bench.feed({0.0, 0.0, 0.0});
  ASSERT_TRUE(eventually([&] { return bench.figure("duplicates") == 1.0; }));
  expect_mean(2, 2.0);

  bench.box.swap_next(1);
  bench.box.feed({10.0, 0.0, 0.0}, {});
  bench.box.feed({2.0, 0.0, 0.0}, {});
  ASSERT_TRUE(eventually([&] { return bench.figure("overtaken") == 1.0; }));
  expect_mean(1, 2.0);
  EXPECT_EQ(bench.figure("box_restarts"), 0.0);
}

TEST_F(NetFtFedFaults, DatagramsThatAreNoRecordsAreCountedAndIgnored) {
  bench.box.send_garbage(50);
  bench.box.send_short(20);
  bench.box.send_long(20);
  ASSERT_TRUE(eventually([&] { return bench.figure("malformed_datagrams") == 90.0; }));
  bench.feed({1.0, 0.0, 0.0});
  const hal::RigSample sample = bench.read();
  EXPECT_EQ(sample.force_count, 1U);
  EXPECT_EQ(sample.status, 0U);
  EXPECT_NEAR(sample.sensor_force_n.x, 1.0, 1e-6);
}

TEST_F(NetFtFedFaults, DatagramsOfAStrangerAreCountedAndIgnored) {
  bench.box.load({9.0, 9.0, 9.0}, {});
  bench.box.send_from_stranger(7);
  ASSERT_TRUE(eventually([&] { return bench.figure("foreign_datagrams") == 7.0; }));
  bench.feed({1.0, 0.0, 0.0});
  const hal::RigSample sample = bench.read();
  EXPECT_EQ(sample.force_count, 1U);
  EXPECT_NEAR(sample.sensor_force_n.x, 1.0, 1e-6);
}

TEST_F(NetFtFedFaults, ALoneRecordOutOfAllOrderChangesNothing) {
  bench.box.send_wild_number();
  for (int i = 0; i < 10; ++i) bench.feed({1.0, 0.0, 0.0});
  EXPECT_EQ(bench.read().force_count, 10U);
  EXPECT_EQ(bench.figure("out_of_order"), 1.0);
  EXPECT_EQ(bench.figure("samples_lost"), 0.0);
  EXPECT_EQ(bench.figure("box_restarts"), 0.0);
}

TEST(NetFtStream, CountsAtTheEndOfTheNumbersAreSaturationAndNoMeasurement) {
  for (const std::int32_t counts :
       {std::numeric_limits<std::int32_t>::min(), std::numeric_limits<std::int32_t>::max()}) {
    FedBench bench;
    ASSERT_FALSE(bench.engage());
    bench.feed({1.0, 0.0, 0.0});
    bench.read();
    bench.box.saturate_counts(counts);
    bench.feed({1.0, 0.0, 0.0});
    const hal::RigSample sample = bench.read();
    EXPECT_EQ(sample.status, status::kForceSaturated | status::kForceMissing);
    EXPECT_NEAR(sample.sensor_force_n.x, 1.0, 1e-6);
    bench.box.saturate_counts(std::nullopt);
    bench.feed({1.5, 0.0, 0.0});
    EXPECT_EQ(bench.read().status, 0U);
  }
}

TEST(NetFtStream, AReadingBeyondTheCalibratedRangeIsSaturation) {
  struct Case {
    hal::Vector3 force_n;
    hal::Vector3 torque_n_mm;
    bool saturated;
  };
  for (const Case& c : {Case{{24.9, -24.9, -34.9}, {249.0, 0.0, -249.0}, false},
                        Case{{25.1, 0.0, 0.0}, {}, true}, Case{{0.0, -25.1, 0.0}, {}, true},
                        Case{{0.0, 0.0, 35.1}, {}, true}, Case{{}, {0.0, 251.0, 0.0}, true}}) {
    FedBench bench;
    ASSERT_FALSE(bench.engage());
    bench.feed(c.force_n, c.torque_n_mm);
    const hal::RigSample sample = bench.read();
    EXPECT_EQ(sample.status, c.saturated ? status::kForceSaturated : 0U);
    EXPECT_EQ(sample.force_count, 1U);
  }
}

TEST(NetFtStream, StatusBitsBecomeFaultsWarningsAndNamedFindings) {
  struct Case {
    std::uint32_t word;
    std::uint32_t bits;
    hal::PartState state;
    const char* finding;
  };
  const Case cases[] = {
      {0x8001'0000U, status::kForceWarning, hal::PartState::kReady, "threshold condition"},
      {0x8002'0000U, status::kForceSaturated, hal::PartState::kReady, "gage saturated"},
      {0x8800'0000U, status::kForceFault | status::kForceMissing, hal::PartState::kFaulty, "serial link"},
      {0x8000'0010U, status::kForceFault | status::kForceMissing, hal::PartState::kFaulty,
       "link to the transducer"},
      {0x8000'0100U, status::kForceFault | status::kForceMissing, hal::PartState::kFaulty,
       "excitation too low"},
      {0x8000'0000U, status::kForceFault | status::kForceMissing, hal::PartState::kFaulty, "without a cause"},
  };
  for (const Case& c : cases) {
    FedBench bench;
    ASSERT_FALSE(bench.engage());
    bench.box.set_status(c.word);
    bench.feed({1.0, 0.0, 0.0});
    EXPECT_EQ(bench.read().status, c.bits) << c.finding;
    EXPECT_TRUE(bench.finds(c.finding));
    EXPECT_EQ(bench.sensor->report().state, c.state) << c.finding;
    bench.box.set_status(0);
    bench.feed({1.0, 0.0, 0.0});
    EXPECT_EQ(bench.read().status, 0U);
  }
}

TEST_F(NetFtFedFaults, AFindingIsKeptForAWhileSoThatPeopleSeeWhatFlickers) {
  bench.box.set_status(0x8800'0000U);
  bench.feed({});
  bench.box.set_status(0);
  for (int i = 0; i < 10; ++i) bench.feed({});
  EXPECT_TRUE(bench.finds("serial link"));
  EXPECT_TRUE(eventually(
      [&] { return bench.sensor->report().state == hal::PartState::kReady && !bench.finds("serial link"); }));
}

TEST_F(NetFtFaults, ALatchedConditionIsAWarningWithItsRemedy) {
  bench.box.latch_condition();
  ASSERT_TRUE(eventually([&] { return (bench.read().status & status::kForceWarning) != 0; }));
  EXPECT_TRUE(eventually([&] { return bench.finds("reset the condition latch"); }));
}

TEST(NetFtStream, ASilentBoxIsLostAskedAgainAndFoundAgain) {
  NetFtBench bench;
  bench.box.load({1.0, 0.0, 0.0}, {});
  ASSERT_FALSE(bench.engage());
  bench.box.set_silent(true);
  ASSERT_TRUE(eventually([&] { return (bench.read().status & status::kForceLost) != 0; }));
  hal::RigSample sample = bench.read();
  EXPECT_EQ(sample.status, status::kForceLost | status::kForceMissing);
  EXPECT_GT(sample.force_age_ns, 500'000'000);
  ASSERT_TRUE(eventually([&] { return bench.sensor->report().state == hal::PartState::kConnecting; }));
  EXPECT_TRUE(bench.finds("no data come from the box"));
  const int asked = bench.box.commands(kStartRequest);
  ASSERT_TRUE(eventually([&] { return bench.box.commands(kStartRequest) >= asked + 3; }));

  bench.box.set_silent(false);
  ASSERT_TRUE(eventually([&] {
    sample = bench.read();
    return sample.force_count > 0 && sample.status == 0;
  }));
  EXPECT_NEAR(sample.sensor_force_n.x, 1.0, 1e-6);
  EXPECT_TRUE(eventually([&] { return bench.sensor->report().state == hal::PartState::kReady; }));
  EXPECT_GE(bench.figure("silences"), 1.0);
  EXPECT_TRUE(bench.finds("stopped within the last minute"));
  // The stream's numbers began again because it was asked for again: no restart of the box.
  EXPECT_EQ(bench.figure("box_restarts"), 0.0);
}

TEST(NetFtStream, AskingAgainBacksOff) {
  NetFtBench bench;
  bench.config.stale_after_ms = 50.0;
  bench.config.retry_first_ms = 50.0;
  bench.config.retry_longest_ms = 60'000.0;
  ASSERT_FALSE(bench.engage());
  bench.box.set_silent(true);
  const double before = bench.figure("stream_requests");
  const auto begin = std::chrono::steady_clock::now();
  ASSERT_TRUE(eventually([&] { return bench.figure("stream_requests") >= before + 5.0; }));
  // Asked at 0, 50, 150, 350, 750 ms … after the silence was noticed: the n-th time after 50 ms × (2ⁿ⁻¹ - 1).
  const double asked = bench.figure("stream_requests") - before;
  const double elapsed_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  EXPECT_LE(asked, 1.0 + std::log2(1.0 + elapsed_s / 0.05) + 1e-9);
}

TEST_F(NetFtFaults, AStreamThatAnotherClientTookIsWonBack) {
  const int asked = bench.box.commands(kStartRequest);
  bench.box.give_stream_away();
  ASSERT_TRUE(eventually([&] { return bench.box.commands(kStartRequest) > asked; }));
  EXPECT_TRUE(eventually([&] {
    const hal::RigSample sample = bench.read();
    return sample.force_count > 0 && sample.status == 0;
  }));
  EXPECT_GE(bench.figure("silences"), 1.0);
  EXPECT_EQ(bench.figure("box_restarts"), 0.0);
}

TEST_F(NetFtFaults, NumbersThatBeginAgainWithinTheStreamAreARestartToo) {
  ASSERT_TRUE(eventually([&] { return bench.figure("samples") > 3000.0; }));
  bench.box.restart_numbers();
  ASSERT_TRUE(eventually([&] { return bench.figure("box_restarts") == 1.0; }));
  EXPECT_TRUE(eventually([&] { return bench.read().force_count > 0; }));
}

TEST_F(NetFtFaults, ASecondRestartWithinTenSecondsIsASensorFault) {
  bool faulty = false;
  const auto restart = [&](double count) {
    const double samples = bench.figure("samples");
    EXPECT_TRUE(eventually([&] { return bench.figure("samples") > samples + 3000.0; }));
    bench.box.restart_numbers();
    EXPECT_TRUE(eventually([&] {
      faulty = faulty || (bench.read().status & status::kForceFault) != 0;
      return bench.figure("box_restarts") + bench.figure("stream_restarts") >= count;
    }));
    faulty = faulty || (bench.read().status & status::kForceFault) != 0;
  };
  restart(1.0);  // of the stream that was asked for
  restart(2.0);
  EXPECT_FALSE(faulty) << "one restart is honest";
  restart(3.0);
  EXPECT_TRUE(faulty || eventually([&] { return (bench.read().status & status::kForceFault) != 0; }));
  EXPECT_TRUE(bench.finds("its own network"));
  EXPECT_TRUE(eventually([&] { return bench.read().status == 0 || bench.finds("is lost"); }))
      << "one tick says it: the guard latches";
}

TEST_F(NetFtFaults, NumbersThatRunAheadOfTimeAreASensorFault) {
  ASSERT_TRUE(eventually([&] { return bench.figure("samples") > 10'000.0; }));
  EXPECT_EQ(bench.figure("implausible_numbers"), 0.0);
  bench.read();
  bench.box.skip_numbers(21'000);  // 3 s of records
  bool faulty = false;
  EXPECT_TRUE(eventually([&] {
    faulty = faulty || (bench.read().status & status::kForceFault) != 0;
    return faulty;
  }));
  EXPECT_EQ(bench.figure("implausible_numbers"), 1.0);
  EXPECT_EQ(bench.figure("box_restarts"), 0.0);
}

TEST(NetFtStream, ADelayedStreamIsStillAStream) {
  NetFtBench bench;
  bench.box.load({1.0, 0.0, 0.0}, {});
  ASSERT_FALSE(bench.engage());
  bench.box.set_delay_s(0.05);
  ASSERT_TRUE(eventually([&] { return bench.box.records_made() > 2000; }));
  EXPECT_TRUE(eventually([&] {
    const hal::RigSample sample = bench.read();
    return sample.force_count > 0 && sample.status == 0;
  }));
  EXPECT_EQ(bench.figure("box_restarts"), 0.0);
}

TEST_F(NetFtFaults, AStreamSlowerThanItSaysIsAFinding) {
  bench.box.set_rate_hz(3000.0);
  EXPECT_TRUE(eventually([&] { return bench.finds("samples a second arrive of the 7000"); }));
}

TEST_F(NetFtFaults, ManyLostSamplesAreAFinding) {
  bench.box.set_loss(0.2);
  EXPECT_TRUE(eventually([&] { return bench.finds("of the samples are lost in the network"); }));
}

/// All at once, seeded: what is counted must fit what was sent.
TEST(NetFtStream, ABadNetworkSpoilsNoMean) {
  NetFtBench bench;
  bench.box.load({0.0, 0.0, 2.5}, {});
  ASSERT_FALSE(bench.engage());
  bench.box.set_loss(0.05);
  bench.box.set_duplication(0.05);
  bench.box.set_reordering(0.05);
  const std::uint64_t made_before = bench.box.records_made();
  while (bench.box.records_made() < made_before + 5000) {
    bench.box.send_garbage(1);
    bench.box.send_short(1);
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
    const hal::RigSample sample = bench.read();
    if (sample.force_count > 0) {
      EXPECT_NEAR(sample.sensor_force_n.z, 2.5, 1e-6);
    }
    EXPECT_EQ(sample.status & (status::kForceFault | status::kForceSaturated), 0U);
  }
  bench.sensor->disengage();
  const auto made = static_cast<double>(bench.box.records_made());
  // Every record made was used, lost, or overtaken (and then counted lost first). The machine may have
  // dropped some more: they are lost, too.
  EXPECT_LE(bench.figure("samples") + bench.figure("samples_lost"), made);
  EXPECT_GE(bench.figure("samples"), 0.5 * (made - 1.0));
  EXPECT_GT(bench.figure("samples_lost"), 0.0);
  EXPECT_GT(bench.figure("duplicates"), 0.0);
  EXPECT_GT(bench.figure("overtaken"), 0.0);
  EXPECT_EQ(bench.figure("box_restarts"), 0.0);
}

}  // namespace
}  // namespace hapticd::netft
