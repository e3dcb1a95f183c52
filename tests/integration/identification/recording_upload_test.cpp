// Recordings on their way from a client to an identification, through the real daemon and the real hapticctl.

#include <gtest/gtest.h>
#include <signal.h>
#include <unistd.h>

#include <atomic>
#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <sstream>
#include <thread>

#include "client/cpp/client.h"
#include "server/grpc/calls/silence_monitor.h"
#include "tests/integration/daemon_process.h"
#include "tests/integration/identification/identifying.h"
#include "tests/integration/running_service.h"
#include "tests/support/process_memory.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/value_of.h"

namespace hapticd::test {
namespace {

using Json = nlohmann::json;

Ran run_hapticctl(const std::string& address, std::vector<std::string> words) {
  words.insert(words.begin(), {"--server", address});
  return run_to_the_end(HAPTICCTL_BINARY, std::move(words));
}

/// Rows of some 330 bytes, as telemetry has them, made as they are sent: as many as fill `bytes`.
class EndlessRecording {
 public:
  explicit EndlessRecording(std::uint64_t bytes) : left_(bytes) {}
  /// Empty at the end.
  std::string next_piece() {
    std::string piece = rows_ == 0 ? "time_s,force_N,position_mm,note\n" : "";
    while (left_ > 0 && piece.size() + kRowBytes <= client::RecordingUpload::kMaxPiece) {
      std::string row = std::to_string(rows_++) + "e-3,1.25,1.5,";
      row.resize(kRowBytes - 1, 'x');
      piece += row + '\n';
      left_ -= std::min<std::uint64_t>(left_, kRowBytes);
    }
    return piece;
  }
  std::uint64_t rows() const { return rows_; }

 private:
  static constexpr std::size_t kRowBytes = 330;
  std::uint64_t left_;
  std::uint64_t rows_ = 0;
};

client::Client connect_client(const std::string& address) {
  return client::Client({.address = address, .timeout = kTimeout});
}

TEST(RecordingUpload, TwoHundredMegabytesPassThroughABoundedMemory) {
  DaemonProcess process({"--listen", "127.0.0.1:0"});
  const std::string address = process.await_address();
  client::Client client = connect_client(address);
  client.rig_state();
  const double before_mb = resident_mb(process.pid());
  v1::RecordingDescription description;
  description.set_name("long.csv");
  EndlessRecording recording(200'000'000);
  client::RecordingUpload upload = client.upload_recording(description);
  for (std::string piece = recording.next_piece(); !piece.empty(); piece = recording.next_piece()) {
    upload.send(std::move(piece));
    ASSERT_TRUE(upload.taken(kTimeout));
  }
  upload.finish();
  const auto answer = upload.answer(kTimeout);
  ASSERT_TRUE(answer.has_value());
  EXPECT_EQ(answer->rows(), recording.rows());
  EXPECT_NEAR(answer->duration_s(), 1e-3 * static_cast<double>(recording.rows() - 1), 1e-6);
  EXPECT_EQ(answer->remarks_size(), 0) << answer->remarks(0);
  const double grown_mb = max_resident_mb(process.pid()) - before_mb;
  RecordProperty("grown_mb", std::to_string(grown_mb));
  EXPECT_LT(grown_mb, 100.0) << "the recording went through the daemon's memory";
  process.end();
}

/// $TMPDIR for daemons that are started while this lives.
class TemporaryPlace {
 public:
  TemporaryPlace() {
    if (const char* before = getenv("TMPDIR")) before_ = before;
    setenv("TMPDIR", folder_.path().c_str(), 1);
  }
  ~TemporaryPlace() { before_.empty() ? unsetenv("TMPDIR") : setenv("TMPDIR", before_.c_str(), 1); }
  bool is_empty() const { return std::filesystem::is_empty(folder_.path()); }

 private:
  TemporaryFolder folder_;
  std::string before_;
};

TEST(RecordingUpload, ADaemonThatIsKilledLeavesNoFileBehind) {
  const TemporaryPlace place;
  DaemonProcess process({"--listen", "127.0.0.1:0"});
  client::Client client = connect_client(process.await_address());
  const auto upload_piece = [&](client::RecordingUpload& upload) {
    EndlessRecording recording(1'000'000);
    upload.send(recording.next_piece());
    return upload.taken(kTimeout);
  };
  client::RecordingUpload whole = client.upload_recording({});
  ASSERT_TRUE(upload_piece(whole));
  whole.finish();
  ASSERT_TRUE(whole.answer(kTimeout).has_value());
  client::RecordingUpload half = client.upload_recording({});
  ASSERT_TRUE(upload_piece(half));
  process.signal(SIGKILL);
  EXPECT_EQ(process.wait(), -SIGKILL);
  EXPECT_TRUE(place.is_empty());
}

TEST(RecordingUpload, WithoutRoomIsRefusedAndNamesThePlace) {
  setenv("TMPDIR", "/nowhere/at/all", 1);
  const RunningService service;
  client::Client client = connect_client(service.address());
  const client::Error error = thrown_by<client::Error>([&] {
    client::RecordingUpload upload = client.upload_recording({});
    upload.send("time_s,force_N,position_mm\n0,0,0\n");
    upload.finish();
    upload.answer(kTimeout);
  });
  EXPECT_EQ(error.code(), "RESOURCE_EXHAUSTED");
  EXPECT_NE(error.detail().remedy().find("TMPDIR"), std::string::npos) << error.what();
  unsetenv("TMPDIR");
}

TEST(RecordingUpload, OfWhichNothingComesIsGivenUp) {
  using std::chrono::milliseconds;
  std::atomic<int> silences{0};
  {
    server::SilenceMonitor patient(std::chrono::hours(1), [&] { ++silences; });
    EXPECT_EQ(patient.during([] { return 7; }), 7);
    EXPECT_FALSE(patient.was_silent());
  }
  EXPECT_EQ(silences, 0);
  server::SilenceMonitor watch(milliseconds(20), [&] { ++silences; });
  watch.during([&] {
    while (silences == 0) std::this_thread::sleep_for(milliseconds(1));
    return true;
  });
  EXPECT_TRUE(watch.was_silent());
  EXPECT_EQ(silences, 1);
}

/// A recording by hapticctl of a hand that presses, from before it begins; in virtual time.
std::string record_presses(const RunningService& service, const TemporaryFolder& folder) {
  constexpr std::uint64_t kTicks = 30'000;
  EXPECT_TRUE(service.load("tap_1d").ok());
  const std::string path = folder.path("own.csv");
  ChildProcess recorder(HAPTICCTL_BINARY,
                        {"--server", service.address(), "telemetry", "record", path, "--decimation", "4"});
  const v1::RigState recorded =
      service.await([](const v1::RigState& s) { return s.telemetry_subscribers() > 0; });
  service.set_hand(v1::HAND_PROGRAM_KIND_PRESS, [](v1::HandProgram& press) {
    press.set_force_n(4.0);
    press.set_hold_s(0.2);
    press.set_repetitions(-1);
  });
  service.await([&](const v1::RigState& s) { return s.tick() > recorded.tick() + kTicks; });
  recorder.signal(SIGINT);
  const int code = recorder.wait();
  // In virtual time a reader that is held up may lose samples (4): such a recording is one, too.
  EXPECT_TRUE(code == 0 || code == 4) << recorder.output() << recorder.errors();
  return path;
}

/// The last line of JSON of an identification of the recording; the upload's in `uploaded`.
Json identified(const std::string& path, Json& uploaded) {
  const RunningService service(touching("rubber_ball_3d", true));
  const Ran ran = run_hapticctl(service.address(), {"identify", "contact", "--object", "mine", "--law",
                                                    "hunt_crossley", "--recording", path, "--json"});
  std::istringstream lines(ran.output);
  Json end = Json::object();
  for (std::string line; std::getline(lines, line);) {
    end = Json::parse(line);
    if (end.contains("upload")) uploaded = end["upload"];
  }
  return end;
}

TEST(OwnRecording, IsIdentifiedAndPlayedAsItIs) {
  const TemporaryFolder folder;
  std::string path;
  Json uploaded;
  Json end = Json::object();
  // The places of the presses in the recording depend on how busy the machine is, and not every fit succeeds.
  constexpr int kAttempts = 3;
  for (int i = 0; i < kAttempts && end.value("model", "").empty(); ++i) {
    {
      const RunningService service(touching("rubber_ball_3d", false));
      path = record_presses(service, folder);
    }
    end = identified(path, uploaded);
    ASSERT_EQ(uploaded["remarks"].size(), 2U) << uploaded.dump();
  }
  ASSERT_FALSE(end.value("model", "").empty()) << end.dump();
  EXPECT_LT(end["residual"].get<double>(), 0.15);

  server::DaemonConfig replay = config_that_replays(path);
  replay.scene = "tap_1d";
  const RunningService player(replay);
  player.await([](const v1::RigState& s) { return s.in_contact() && s.reaction_force_n() > 0.5; });
}

}  // namespace
}  // namespace hapticd::test
