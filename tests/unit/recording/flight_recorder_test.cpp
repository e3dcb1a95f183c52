#include "server/recording/flight/flight_recorder.h"

#include <filesystem>
#include <fstream>

#include "hal/recording/recording_names.h"
#include "rt/guard/fault_table.h"
#include "server/process/system_clock.h"
#include "tests/unit/recording/recording_fixture.h"

namespace hapticd::server {
namespace {

namespace fs = std::filesystem;
using recording::EventKind;

constexpr std::int64_t kTicksPerS = 100;
constexpr std::int64_t kBeforeTicks = 20 * kTicksPerS;
constexpr std::int64_t kAfterTicks = 2 * kTicksPerS;

class FlightRecorderTest : public RecordingTest {
 protected:
  FlightRecorder& flight() {
    if (!flight_) {
      flight_ = std::make_unique<FlightRecorder>(hub_, event_log_, sources_, config_);
      test::demand(flight_->open());
    }
    return *flight_;
  }
  /// Ticks that the recorder has seen.
  void flown(std::uint64_t count) {
    for (std::uint64_t done = 0; done < count;) {
      const std::uint64_t now = std::min<std::uint64_t>(count - done, 500);
      const std::uint64_t goal = flight().rows_kept() + now;
      tick(now);
      ASSERT_TRUE(test::eventually([&] { return flight().rows_kept() >= goal; }));
      done += now;
    }
  }
  /// All incidents, once there are `count` and the last one is written to its end.
  std::vector<RecordingInfo> incidents(std::size_t count) {
    EXPECT_TRUE(test::eventually([&] {
      const auto list = *flight().list();
      return list.size() >= count && !list.back().end_reason.empty() && flight().last().has_value();
    }));
    return *flight().list();
  }
  Seen seen_of(const RecordingInfo& info) { return read_all(*flight().path_of(info.id)); }

  std::unique_ptr<FlightRecorder> flight_;
};

TEST_F(FlightRecorderTest, AStopLeavesEveryTickAroundIt) {
  flight();
  flown(2500);
  for (const std::uint64_t tick : {2400U, 100U}) {  // late, and older than the first row
    recording::Event event;
    event.kind = EventKind::kCommand;
    event.tick = tick;
    event.time_ns = static_cast<std::int64_t>(tick) * 1'000'000'000 / kTicksPerS;
    event_log_.add(std::move(event));
  }
  engine_.stop();
  flown(2 * kAfterTicks);
  const auto list = incidents(1);
  ASSERT_EQ(list.size(), 1U);
  EXPECT_EQ(list[0].cause, "stopped");
  const Seen seen = seen_of(list[0]);
  EXPECT_TRUE(seen.end.is_finished);
  EXPECT_EQ(missing(seen.ticks), 0);
  EXPECT_NEAR(list[0].duration_s, seen.rows_s, 1e-6);
  EXPECT_TRUE(std::ranges::is_sorted(seen.events, {}, &recording::Event::time_ns));
  EXPECT_TRUE(std::ranges::is_sorted(seen.log_times_ns));
  const std::uint64_t shown_ns = seen.log_times_ns.back() - seen.log_times_ns.front();
  EXPECT_LE(1e-9 * static_cast<double>(shown_ns), seen.rows_s) << "other programs show what has no rows";
  const auto cause = static_cast<std::int64_t>(list[0].cause_tick);
  EXPECT_EQ(seen.ticks.front(), cause - kBeforeTicks);
  EXPECT_GE(seen.ticks.back(), cause + kAfterTicks);
  EXPECT_NEAR(list[0].cause_after_s, 20.0, 0.02);
  EXPECT_TRUE(seen.has(EventKind::kStop));
  EXPECT_EQ(seen.metadata.at(recording::kStartMetadata).at("rig"), "still");
  EXPECT_EQ(flight().last()->id, list[0].id);
}

class EveryCut : public FlightRecorderTest, public testing::WithParamInterface<std::string> {};

TEST_P(EveryCut, LeavesACompleteIncidentWithItsName) {
  const rt::FaultRule& rule = *std::ranges::find(rt::kFaultTable, GetParam(), &rt::FaultRule::name);
  flight();
  flown(2100);
  engine_.raise(rule.fault);
  flown(kAfterTicks + 50);
  const auto list = incidents(1);
  ASSERT_EQ(list.size(), 1U);
  EXPECT_EQ(list[0].cause, rule.name);
  EXPECT_NE(list[0].end_reason.find(rule.cause), std::string::npos) << list[0].end_reason;
  const Seen seen = seen_of(list[0]);
  const auto cause = static_cast<std::int64_t>(list[0].cause_tick);
  EXPECT_EQ(missing(seen.ticks), 0);
  EXPECT_EQ(seen.ticks.front(), cause - kBeforeTicks);
  EXPECT_GE(seen.ticks.back(), cause + kAfterTicks);
}

std::vector<std::string> cutting_faults() {
  std::vector<std::string> faults;
  for (const rt::FaultRule& rule : rt::kFaultTable) {
    // A stop says of itself that it is one; of an unclean end, the ring that it left is the incident.
    const bool is_other = rule.fault == rt::GuardFault::kStopped || rule.fault == rt::GuardFault::kUncleanEnd;
    if (rule.action == rt::FaultAction::kCut && !is_other) faults.emplace_back(rule.name);
  }
  return faults;
}
INSTANTIATE_TEST_SUITE_P(FlightRecorder, EveryCut, testing::ValuesIn(cutting_faults()),
                         [](const auto& fault) { return fault.param; });

TEST_F(FlightRecorderTest, ARequestDoesSoToo) {
  flight();
  flown(100);
  ASSERT_FALSE(flight().request("it felt odd", "user:anna"));
  ASSERT_TRUE(test::eventually([this] {
    flown(10);
    return flight().last().has_value();
  }));
  const auto list = incidents(1);
  EXPECT_EQ(list[0].cause, "requested");
  EXPECT_EQ(list[0].end_reason, "it felt odd (by user:anna)");
  EXPECT_EQ(seen_of(list[0]).ticks.front(), 0) << "all there is, where that is less";
}

// Ten thousand requests a second, which an operator may send, made an incident whose words no client could
// read, and took as much memory as they were long.
TEST_F(FlightRecorderTest, AFloodOfRequestsIsOneShortIncident) {
  flight();
  flown(100);
  std::optional<Refusal> refused;
  for (int i = 0; i < 20'000; ++i) {
    if (auto why = flight().request(std::string(1024, 'x'), "user:otto")) refused = std::move(why);
  }
  ASSERT_TRUE(refused);
  EXPECT_EQ(refused->kind, RefusalKind::kResourceExhausted);
  flown(kAfterTicks + 50);
  const auto list = incidents(1);
  ASSERT_EQ(list.size(), 1U);
  EXPECT_LT(list[0].end_reason.size(), FlightRecorder::kMaxWords + 2048);
  EXPECT_TRUE(list[0].end_reason.ends_with(" more")) << list[0].end_reason;
}

TEST_F(FlightRecorderTest, AFloodOfEventsLeavesTheNewestAndSaysThatOthersAreMissing) {
  flight();
  flown(100);
  for (int round = 0; round < 4; ++round) {
    for (std::size_t i = 0; i < EventLog::kKept; ++i) {
      recording::Event event;
      event.kind = EventKind::kCommand;
      event.tick = next_tick_ - 1;
      event.time_ns = static_cast<std::int64_t>(event.tick) * 10'000'000;
      event_log_.add(std::move(event));
    }
    flown(10);
  }
  ASSERT_FALSE(flight().request("what was that", ""));
  flown(kAfterTicks + 50);
  const Seen seen = seen_of(incidents(1)[0]);
  EXPECT_LE(seen.events.size(), FlightRecorder::kMaxEvents + 1);
  EXPECT_TRUE(seen.has(EventKind::kLoss));
  EXPECT_TRUE(seen.has(EventKind::kAnnotation)) << "the newest";
}

TEST_F(FlightRecorderTest, CausesThatFollowOneAnotherAreOneIncident) {
  flight();
  flown(300);
  engine_.stop();
  flown(50);
  engine_.raise(rt::GuardFault::kPedalReleased);
  ASSERT_FALSE(flight().request("what was that", ""));
  flown(1000);
  EXPECT_EQ(incidents(1).size(), 1U);
}

TEST_F(FlightRecorderTest, AStopWhileAnotherFaultIsLatchedLeavesOneToo) {
  flight();
  flown(300);
  engine_.raise(rt::GuardFault::kDeviceFault);
  flown(1000);
  ASSERT_EQ(incidents(1).size(), 1U);
  // The guard stays with the first fault; only the call is known.
  engine_.stop();
  recording::Event call;
  call.kind = EventKind::kStop;
  call.text = "SafetyService/Stop";
  call.by = "user:anna";
  call.unix_ns = read_clocks().utc_ns;
  call.tick = engine_.last_tick();
  call.time_ns = static_cast<std::int64_t>(call.tick) * 1'000'000'000 / kTicksPerS;
  event_log_.add(std::move(call));
  flown(1000);
  const auto list = incidents(2);
  ASSERT_EQ(list.size(), 2U);
  EXPECT_EQ(list[1].cause, "stopped");
  EXPECT_EQ(list[1].end_reason, "SafetyService/Stop (by user:anna)");
}

TEST_F(FlightRecorderTest, WhatTakesTheForceNamesTheIncident) {
  flight();
  flown(300);
  ASSERT_FALSE(flight().request("what was that", ""));
  flown(50);
  engine_.stop();
  flown(1000);
  const auto list = incidents(1);
  ASSERT_EQ(list.size(), 1U);
  EXPECT_EQ(list[0].cause, "stopped");
  EXPECT_NE(list[0].end_reason.find("before: what was that"), std::string::npos) << list[0].end_reason;
  EXPECT_GE(seen_of(list[0]).ticks.back(), static_cast<std::int64_t>(list[0].cause_tick) + kAfterTicks);
}

TEST_F(FlightRecorderTest, WhatIsUnderWayAtTheEndIsWritten) {
  flight();
  flown(300);
  engine_.stop();
  flown(10);
  flight().shutdown();
  const auto list = flight().list();
  ASSERT_EQ(list->size(), 1U);
  EXPECT_EQ(missing(seen_of(list->front()).ticks), 0);
  EXPECT_FALSE(fs::exists(config_.folder + "/flight-0.ring")) << "the run ended in order";
}

TEST_F(FlightRecorderTest, TheDaemonsOwnLastStopIsNone) {
  flight();
  flown(100);
  flight().end();
  engine_.stop();
  flown(10);
  flight().shutdown();
  EXPECT_TRUE(flight().list()->empty());
}

TEST_F(FlightRecorderTest, TheRingOfARunThatCrashedBecomesAnIncident) {
  flight();
  flown(5000);
  // As a crash leaves it: the file as it is now, and not open in any process.
  const std::string other = folder_.path("other");
  fs::create_directories(other);
  fs::copy_file(config_.folder + "/flight-0.ring", other + "/flight-0.ring");
  RecordingConfig config = config_;
  config.folder = other;
  FlightRecorder next(hub_, event_log_, sources_, config);
  test::demand(next.open());
  ASSERT_TRUE(test::eventually([&] { return next.last().has_value(); }));
  const auto list = next.list();
  ASSERT_EQ(list->size(), 1U);
  EXPECT_EQ(list->front().cause, "unclean_end");
  const Seen seen = read_all(*next.path_of(list->front().id));
  EXPECT_EQ(seen.ticks.size(), 3000U) << "30 s";
  EXPECT_EQ(missing(seen.ticks), 0);
  EXPECT_EQ(seen.ticks.back(), 4999);
  next.shutdown();
  EXPECT_TRUE(fs::is_empty(other + "/incidents") == false && !fs::exists(other + "/flight-0.ring") &&
              !fs::exists(other + "/flight-0.ring.left"));
}

TEST_F(FlightRecorderTest, TwoDaemonsWithOneFolderHaveARingEach) {
  flight();
  FlightRecorder second(hub_, event_log_, sources_, config_);
  test::demand(second.open());
  EXPECT_TRUE(second.is_on());
  EXPECT_TRUE(fs::exists(config_.folder + "/flight-1.ring"));
}

TEST_F(FlightRecorderTest, ARingThatCannotBeReadIsPutAside) {
  fs::create_directories(config_.folder);
  std::ofstream(config_.folder + "/flight-0.ring") << "nothing";
  flown(10);
  EXPECT_TRUE(flight().is_on());
  EXPECT_TRUE(flight().list()->empty());
}

TEST_F(FlightRecorderTest, TheOldestIncidentsMakeRoom) {
  config_.incident_quota_mb = 0.05;
  fs::create_directories(config_.folder + "/incidents");
  std::ofstream(config_.folder + "/incidents/20200101T000000Z_old.mcap") << std::string(100'000, 'x');
  flight();
  flown(300);
  engine_.stop();
  flown(300);
  ASSERT_TRUE(
      test::eventually([this] { return flight().last() && flight().last()->id.ends_with("_stopped"); }));
  ASSERT_TRUE(test::eventually([this] { return flight().list()->size() == 1; }));
  EXPECT_EQ(flight().list()->front().cause, "stopped");
}

// A client that requested incidents, or stopped, again and again filled the folder until that of a fault was
// gone.
TEST_F(FlightRecorderTest, WhatClientsCauseMakesRoomBeforeFaults) {
  config_.incident_quota_mb = 0.25;
  const std::string incidents = config_.folder + "/incidents/";
  fs::create_directories(incidents);
  const auto put = [&](const std::string& id) {
    std::ofstream(incidents + id + ".mcap") << std::string(100'000, 'x');
  };
  const auto is_there = [&](const std::string& id) { return fs::exists(incidents + id + ".mcap"); };
  put("00001_20260101T000000Z_sensor_stale");
  put("00002_20260101T000000Z_stopped");
  put("00003_20260101T000000Z_stopped");
  flight();
  flown(300);
  ASSERT_FALSE(flight().request("again and again", "user:otto"));
  flown(kAfterTicks + 50);
  ASSERT_TRUE(test::eventually([this] { return flight().last()->id.ends_with("_requested"); }));
  const std::string requested = flight().last()->id;
  EXPECT_EQ(flight().list()->size(), 4U) << "it takes the place of none";
  engine_.stop();
  flown(kAfterTicks + 50);
  ASSERT_TRUE(test::eventually([this] { return flight().last()->id.ends_with("_stopped"); }));
  ASSERT_TRUE(test::eventually([&] { return !is_there("00002_20260101T000000Z_stopped"); }));
  EXPECT_FALSE(is_there(requested));
  EXPECT_TRUE(is_there("00001_20260101T000000Z_sensor_stale")) << "its cause does not take most";
}

TEST_F(FlightRecorderTest, WithoutAFolderItIsOffAndSaysSo) {
  config_.folder.clear();
  EXPECT_FALSE(flight().is_on());
  EXPECT_EQ(flight().request("x", "")->error.what, "the flight recorder is off");
  EXPECT_EQ(flight().list().refusal().error.what, "the flight recorder is off");
}

}  // namespace
}  // namespace hapticd::server
