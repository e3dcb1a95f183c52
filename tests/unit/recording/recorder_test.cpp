#include "server/recording/recorder.h"

#include <sys/resource.h>

#include <algorithm>
#include <atomic>
#include <csignal>
#include <filesystem>
#include <fstream>

#include "hal/recording/recording_names.h"
#include "tests/support/room_for_threads.h"
#include "tests/support/texts.h"
#include "tests/support/value_of.h"
#include "tests/unit/recording/recording_fixture.h"

namespace hapticd::server {
namespace {

namespace fs = std::filesystem;
using recording::EventKind;
using test::value_of;

class RecorderTest : public RecordingTest {
 protected:
  explicit RecorderTest(std::size_t ring = 8192) : RecordingTest(ring) {}

  Recorder& recorder() {
    if (!recorder_) {
      recorder_ = std::make_unique<Recorder>(hub_, event_log_, sources_, config_);
      test::demand(recorder_->open());
    }
    return *recorder_;
  }
  RecordingInfo started(const std::string& name = "test") {
    const auto info = recorder().start({name, "a note", "user:anna", 0, 1});
    if (!info) throw std::runtime_error(info.refusal().error.text());
    return *info;
  }
  RecordingInfo stopped() {
    const auto info = recorder().stop("user:anna");
    if (!info) throw std::runtime_error(info.refusal().error.text());
    return *info;
  }
  Seen seen_of(const RecordingInfo& info) { return read_all(*recorder().path_of(info.id)); }
  std::string recordings() const { return config_.folder + "/recordings"; }

  std::unique_ptr<Recorder> recorder_;
};

TEST_F(RecorderTest, EveryTickIsInTheFile) {
  tick(10);
  const RecordingInfo running = started();
  tick(1000);
  EXPECT_EQ(recorder().running()->id, running.id);
  const RecordingInfo info = stopped();
  EXPECT_EQ(info.rows, 1000U);
  EXPECT_EQ(info.lost_ticks, 0U);
  EXPECT_FALSE(recorder().running());
  const Seen seen = seen_of(info);
  ASSERT_EQ(seen.ticks.size(), 1000U);
  EXPECT_EQ(seen.ticks.front(), 10);
  EXPECT_EQ(missing(seen.ticks), 0);
  EXPECT_TRUE(seen.end.is_finished);
  EXPECT_EQ(seen.metadata.at(recording::kStartMetadata).at("rig"), "still");
  EXPECT_EQ(seen.metadata.at(recording::kStartMetadata).at("by"), "user:anna");
  EXPECT_EQ(seen.metadata.at(recording::kSceneMetadata).at("name"), "none");
  EXPECT_EQ(seen.metadata.at(recording::kConfigurationMetadata).at("toml"), "[loop]\n");
  EXPECT_TRUE(seen.metadata.contains(recording::kAnchorMetadata));
  EXPECT_EQ(seen.metadata.at(recording::kEndMetadata).at("reason"), "stopped by user:anna");
}

TEST_F(RecorderTest, LeavesNothingBehindWhereThereAreTooFewThreads) {
  recorder();
  for (const std::size_t threads : {0U, 1U}) {  // it needs two
    {
      const test::RoomForThreads room(threads);
      const auto refused = recorder().start({"test", "", "", 0, 1});
      ASSERT_FALSE(refused) << threads;
      EXPECT_EQ(refused.refusal().kind, RefusalKind::kResourceExhausted);
      EXPECT_EQ(refused.refusal().error.where, "threads");
    }
    EXPECT_FALSE(recorder().running());
    EXPECT_TRUE(fs::is_empty(recordings()));
  }
  started();
  tick(10);
  EXPECT_EQ(stopped().rows, 10U);
}

TEST_F(RecorderTest, WhatIsLostIsAnEventInTheFile) {
  started();
  tick(100);
  tick(10'000, false);  // more than the loop's ring holds
  tick(100);
  const RecordingInfo info = stopped();
  const Seen seen = seen_of(info);
  const std::int64_t lost = missing(seen.ticks);
  EXPECT_GT(lost, 0);
  EXPECT_EQ(info.lost_ticks, static_cast<std::uint64_t>(lost));
  std::uint64_t reported = 0;
  for (const recording::Event& event : seen.events) {
    if (event.kind == EventKind::kLoss) reported += event.lost_ticks;
  }
  EXPECT_EQ(reported, static_cast<std::uint64_t>(lost));
}

TEST_F(RecorderTest, DecimationAndGroupsAreThoseAskedFor) {
  ASSERT_TRUE(recorder().start({"", "", "", rt::channel::kGuard, 10}));
  tick(1000);
  const RecordingInfo info = stopped();
  EXPECT_EQ(info.rows, 100U);
  EXPECT_EQ(info.lost_ticks, 0U);
  const auto file = value_of(recording::RecordingFile::open(*recorder().path_of(info.id)));
  ASSERT_EQ(file.columns().size(), 4U);
  EXPECT_EQ(file.columns()[3].name, "guard_authority");
  EXPECT_EQ(recorder().start({"", "", "", 0, 0}).refusal().kind, RefusalKind::kOutOfRange);
  EXPECT_EQ(recorder().start({"", "", "", rt::channel::kTruth, 1}).refusal().error.what,
            "this rig has none of these groups");
}

TEST_F(RecorderTest, NotesStopsAndCommandsAreEvents) {
  started();
  tick(10);
  ASSERT_FALSE(recorder().annotate("too hard", "user:ben"));
  engine_.stop();
  tick(10);
  const Seen seen = seen_of(stopped());
  EXPECT_TRUE(seen.has(EventKind::kStop));
  EXPECT_TRUE(seen.has(EventKind::kEnd));
  const auto note = std::find_if(seen.events.begin(), seen.events.end(),
                                 [](const auto& event) { return event.kind == EventKind::kAnnotation; });
  ASSERT_NE(note, seen.events.end());
  EXPECT_EQ(note->text, "too hard");
  EXPECT_EQ(note->by, "user:ben");
  EXPECT_GT(note->unix_ns, 0);
}

TEST_F(RecorderTest, NamesStayInTheFolder) {
  for (const std::string& name : {std::string("../../outside"), std::string("a/b"), std::string(300, 'x'),
                                  std::string("täp\n"), std::string()}) {
    const RecordingInfo info = started(name);
    tick(5);
    stopped();
    const fs::path path = *recorder().path_of(info.id);
    EXPECT_EQ(path.parent_path(), recordings()) << name;
    EXPECT_LT(info.id.size(), 100U);
  }
  EXPECT_EQ(recorder().list()->size(), 5U);
  EXPECT_FALSE(fs::exists(folder_.path("outside.mcap")));
}

TEST_F(RecorderTest, RefusalsNameWhatIsWrong) {
  EXPECT_EQ(recorder().stop("").refusal().error.what, "no recording is running");
  EXPECT_EQ(recorder().annotate("x", "")->error.what, "no recording is running");
  const RecordingInfo info = started();
  tick(5);
  const auto second = test::refusal_of(recorder().start({"b", "", "", 0, 1}));
  EXPECT_EQ(second.reason, Reason::kBusy);
  EXPECT_EQ(second.error.value, info.id);
  EXPECT_EQ(recorder().path_of(info.id).refusal().reason, Reason::kBusy);
  EXPECT_EQ(recorder().remove(info.id).refusal().reason, Reason::kBusy);
  EXPECT_TRUE(recorder().annotate("", ""));
  stopped();
  for (const char* id : {"nothing", "../recordings/x", "", "."}) {
    EXPECT_EQ(recorder().path_of(id).refusal().kind, RefusalKind::kNotFound) << id;
  }
  ASSERT_TRUE(recorder().remove(info.id));
  EXPECT_EQ(recorder().remove(info.id).refusal().kind, RefusalKind::kNotFound);
}

TEST_F(RecorderTest, WithoutAFolderThereAreNoRecordings) {
  config_.folder.clear();
  EXPECT_EQ(test::refusal_of(recorder().start({"", "", "", 0, 1})).error.where, "[recording] folder");
}

TEST_F(RecorderTest, AFolderThatCannotBeWrittenIsNamed) {
  config_.folder = folder_.write("file", "");  // no folder can be below a file; root may write to any folder
  Recorder recorder(hub_, event_log_, sources_, config_);
  const auto error = test::error_of(recorder.open());
  EXPECT_EQ(error.where, config_.folder + "/recordings");
  EXPECT_EQ(test::refusal_of(recorder.start({"", "", "", 0, 1})).error.where, error.where);
}

TEST_F(RecorderTest, AQuotaThatIsUsedUpIsNamedOrTheOldestMakesRoom) {
  config_.quota_mb = 1.0;
  fs::create_directories(recordings());
  std::ofstream(recordings() + "/20200101T000000Z_old.mcap") << std::string(1'500'000, 'x');
  const auto refused = test::refusal_of(recorder().start({"", "", "", 0, 1}));
  EXPECT_EQ(refused.kind, RefusalKind::kResourceExhausted);
  EXPECT_EQ(refused.reason, Reason::kDiskFull);
  EXPECT_EQ(refused.error.code, hal::ErrorCode::kFull);
  EXPECT_EQ(refused.error.where, "[recording] quota_mb");
  EXPECT_EQ(refused.error.limit, "1 MB");
  EXPECT_TRUE(fs::exists(recordings() + "/20200101T000000Z_old.mcap"));

  config_.when_full = WhenFull::kRemoveOldest;
  recorder_.reset();
  started();
  tick(5);
  stopped();
  EXPECT_FALSE(fs::exists(recordings() + "/20200101T000000Z_old.mcap"));
}

TEST_F(RecorderTest, WithoutRoomForTheFirstSecondsNoneBegins) {
  sources_.rate_hz = 1e15;  // 10¹¹ MB in 3 s: no disk has them
  config_.quota_mb = 1e13;
  const auto full = recorder().start({"", "", "", 0, 1});
  ASSERT_FALSE(full);
  EXPECT_EQ(full.refusal().kind, RefusalKind::kResourceExhausted);
  EXPECT_EQ(full.refusal().reason, Reason::kDiskFull);
  EXPECT_EQ(full.refusal().error.what, "the disk is nearly full");
  EXPECT_EQ(full.refusal().error.where, recordings());
  EXPECT_TRUE(test::holds(full.refusal().error.limit, "MB for the first seconds"));
  EXPECT_EQ(full.refusal().error.remedy, "make room there");

  config_.quota_mb = 1.0;
  config_.when_full = WhenFull::kRemoveOldest;
  const std::string old = recordings() + "/20200101T000000Z_old.mcap";
  std::ofstream(old) << "x";
  recorder_.reset();
  const auto too_much = test::refusal_of(recorder().start({"", "", "", 0, 1}));
  EXPECT_EQ(too_much.reason, Reason::kDiskFull);
  EXPECT_EQ(too_much.error.what, "the quota is too small for this recording");
  EXPECT_TRUE(test::holds(too_much.error.value, "MB for the first seconds"));
  EXPECT_FALSE(recorder().running());
  EXPECT_EQ(recorder().folder().ids(), std::vector{fs::path(old).stem().string()})
      << "none is deleted in vain";

  sources_.rate_hz = 100.0;
  started();
  tick(10);
  EXPECT_EQ(stopped().rows, 10U);
}

TEST_F(RecorderTest, AClockThatIsSetBackChangesNeitherOrderNorLength) {
  constexpr std::int64_t kHourNs = 3'600'000'000'000;
  std::atomic<std::int64_t> set_ns{0};
  sources_.clocks = [&set_ns] {
    ClockReading reading = read_clocks();
    reading.utc_ns += set_ns;
    return reading;
  };
  config_.when_full = WhenFull::kRemoveOldest;
  fs::create_directories(recordings());
  std::ofstream(recordings() + "/20990101T000000Z_of_an_earlier_version.mcap") << "x";
  std::vector<std::string> ids{"20990101T000000Z_of_an_earlier_version"};
  ids.push_back(started("during").id);
  tick(100);
  ASSERT_TRUE(test::eventually([this] { return recorder().running()->rows >= 100; }));
  set_ns = -kHourNs;
  ASSERT_FALSE(recorder().annotate("just set", ""));
  tick(100);
  // It is looked at once a second.
  std::this_thread::sleep_for(std::chrono::milliseconds(1200));
  tick(100);
  const RecordingInfo during = stopped();
  ids.push_back(started("after").id);
  tick(100);
  stopped();

  const auto list = recorder().list();
  ASSERT_EQ(list->size(), ids.size());
  for (std::size_t i = 0; i < ids.size(); ++i) EXPECT_EQ((*list)[i].id, ids[i]);
  const Seen seen = seen_of(during);
  EXPECT_NEAR((*list)[1].duration_s, seen.rows_s, 1e-6);
  EXPECT_TRUE(std::ranges::is_sorted(seen.log_times_ns));
  const auto is_told = [](const recording::Event& event) {
    return event.text.find("clock was set back by 3600.0") != std::string::npos;
  };
  EXPECT_EQ(std::ranges::count_if(seen.events, is_told), 1);

  constexpr double kFirstMb = 0.017;  // what is kept for the first 3 s of another one: 301 rows, and texts
  config_.quota_mb = 1e-6 * static_cast<double>((*list)[2].bytes) + 0.002 + kFirstMb;
  recorder_.reset();
  started("last");
  stopped();
  EXPECT_FALSE(recorder().path_of(ids[1])) << "the oldest makes room";
  EXPECT_TRUE(recorder().path_of(ids[2]));
}

TEST_F(RecorderTest, ARecordingThatOutgrowsTheQuotaEndsWhole) {
  config_.quota_mb = 0.1;
  started();
  ASSERT_TRUE(test::eventually([this] {
    tick(1000);
    return !recorder().running();
  }));
  const RecordingInfo info = stopped();
  EXPECT_TRUE(test::holds(info.end_reason, "the quota is too small for this recording"));
  const Seen seen = seen_of(info);
  EXPECT_TRUE(seen.end.is_finished);
  EXPECT_TRUE(seen.has(EventKind::kEnd));
  tick(10);  // rendering goes on
  EXPECT_EQ(hub_.latest().tick, next_tick_ - 1);
}

/// A limit of file sizes in the place of a full disk: the same error at the same place.
class FileSizeLimit {
 public:
  explicit FileSizeLimit(rlim_t bytes) {
    getrlimit(RLIMIT_FSIZE, &before_);
    handler_ = std::signal(SIGXFSZ, SIG_IGN);
    const rlimit limit{bytes, before_.rlim_max};
    setrlimit(RLIMIT_FSIZE, &limit);
  }
  ~FileSizeLimit() {
    setrlimit(RLIMIT_FSIZE, &before_);
    std::signal(SIGXFSZ, handler_);
  }
  FileSizeLimit(const FileSizeLimit&) = delete;
  FileSizeLimit& operator=(const FileSizeLimit&) = delete;

 private:
  rlimit before_{};
  void (*handler_)(int) = SIG_DFL;
};

TEST_F(RecorderTest, AFullDiskEndsTheRecordingAndNothingElse) {
  for (const rlim_t limit : {60'000U, 64'001U}) {
    const FileSizeLimit full(limit);
    started("full");
    // Chunk by chunk: one that alone is larger than the disk would leave nothing.
    std::uint64_t rows = 0;
    while (recorder().running()) {
      tick(2000);
      ASSERT_TRUE(test::eventually([&] {
        const auto running = recorder().running();
        return !running || running->rows > rows;
      }));
      if (const auto running = recorder().running()) rows = running->rows;
    }
    const RecordingInfo info = stopped();
    EXPECT_TRUE(test::holds(info.end_reason, "the file reached the largest size"));
    const Seen seen = seen_of(info);
    EXPECT_TRUE(seen.end.is_finished) << seen.end.damage;
    EXPECT_GT(seen.ticks.size(), 100U);
    EXPECT_EQ(seen.metadata.at(recording::kEndMetadata).at("rows"), std::to_string(seen.ticks.size()));
    EXPECT_EQ(missing(seen.ticks), 0);
    tick(10);  // rendering goes on
    EXPECT_EQ(hub_.latest().tick, next_tick_ - 1);
  }
}

TEST_F(RecorderTest, WithoutRoomForItsBeginningThereIsNoFile) {
  sources_.block_schema = std::string(5000, 'x');
  recorder();
  for (const rlim_t limit : {0U, 100U, 5000U, 5100U}) {
    const FileSizeLimit full(limit);
    EXPECT_FALSE(recorder().start({"", "", "", 0, 1})) << limit;
    EXPECT_TRUE(fs::is_empty(recordings())) << limit;
  }
}

TEST_F(RecorderTest, WhatAnEarlierRunLeftIsFinishedAtTheStart) {
  const RecordingInfo info = started();
  tick(200);
  ASSERT_TRUE(test::eventually([this] { return recorder().running()->rows >= 200; }));
  const std::string path = recordings() + "/" + info.id + ".mcap";
  const std::string other = folder_.path("other");
  fs::create_directories(other + "/recordings");
  const std::string left = other + "/recordings/" + info.id + ".mcap";
  fs::copy_file(path, left);
  fs::resize_file(left, fs::file_size(left) - 3);
  stopped();

  RecordingConfig config = config_;
  config.folder = other;
  Recorder next(hub_, event_log_, sources_, config);
  test::demand(next.open());
  const auto list = value_of(next.list());
  ASSERT_EQ(list.size(), 1U);
  EXPECT_EQ(list.front().state, RecordingState::kRepaired);
  EXPECT_EQ(list.front().name, "test");
  const Seen seen = read_all(left);
  EXPECT_EQ(list.front().rows, seen.ticks.size());
  EXPECT_NEAR(list.front().duration_s, seen.rows_s, 1e-6);
  EXPECT_TRUE(next.path_of(info.id));
}

TEST_F(RecorderTest, AForeignFileIsListedAsOne) {
  fs::create_directories(recordings());
  std::ofstream(recordings() + "/strange.mcap") << "no recording";
  const auto list = value_of(recorder().list());
  ASSERT_EQ(list.size(), 1U);
  EXPECT_EQ(list.front().state, RecordingState::kForeign);
}

}  // namespace
}  // namespace hapticd::server
