// Identifications on the simulated rig without the network: what clients do at the same time, from separate
// threads.

#include "server/identification/run/identification_runner.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <cmath>
#include <random>
#include <string>
#include <thread>
#include <vector>

#include "hal/sim/simulated_rig.h"
#include "server/model/store/model_library.h"
#include "server/model/store/model_store.h"
#include "server/rig/sensor_bias.h"
#include "server/scene/scene_host.h"
#include "server/session/session.h"
#include "server/telemetry/telemetry_hub.h"
#include "tests/support/quiet_loop.h"
#include "tests/support/room_for_threads.h"
#include "tests/support/value_of.h"

namespace hapticd::server {
namespace {

std::unique_ptr<hal::Rig> sponge_in_virtual_time() {
  return std::move(*sim::SimulatedRig::create({.object = "sponge_cut"}));
}

Caller patient() {
  return {.deadline = Caller::Clock::now() + std::chrono::seconds(60)};
}

class RunnerBench {
 public:
  RunnerBench() {
    session.start();
    hub.start();
  }
  ~RunnerBench() {
    runner.shutdown();
    hub.stop();
    session.stop();
  }

  std::shared_ptr<ModelStore> store = std::move(*ModelStore::open(""));
  Session session{sponge_in_virtual_time(), hapticd::test::quiet_loop()};
  TelemetryHub hub{session.engine()};
  SceneHost scenes{session, SceneLibrary(), ModelLibrary("", store)};
  SensorBiases biases{session, scenes, hub, ""};
  IdentificationRunner runner{session, scenes, hub, biases, *store};
};

IdentificationRequest contact_request() {
  IdentificationRequest request;
  request.task = identification::ContactTask{};
  request.object = "mine";
  return request;
}

TEST(IdentificationRunner, ReportsAndEndsWhateverClientsAskMeanwhile) {
  RunnerBench bench;
  std::atomic<bool> done{false};
  std::vector<std::thread> clients;
  clients.emplace_back([&] {
    while (!done) (void)bench.runner.list();
  });
  clients.emplace_back([&] {  // the end of another one's lease concerns nothing here
    while (!done) bench.runner.end_under(7, {"the lease has ended", "lease", "", "", "acquire one"});
  });
  clients.emplace_back([&] {
    std::uint64_t version = 0;
    while (!done) {
      Caller caller{.deadline = Caller::Clock::now() + std::chrono::milliseconds(20)};
      const auto report = bench.runner.report("", version, caller);
      if (report) version = report->version;
    }
  });
  for (int round = 0; round < 3; ++round) {
    const auto id = hapticd::test::value_of(bench.runner.start(contact_request(), 3));
    std::this_thread::yield();
    if (round == 1) bench.runner.end_under(3, {"the lease has ended", "lease", "", "", "acquire one"});
    const auto ended = hapticd::test::value_of(bench.runner.cancel(id, patient()));
    EXPECT_NE(ended.state, IdentificationState::kRunning);
    EXPECT_NE(ended.state, IdentificationState::kConverged);
  }
  done = true;
  for (std::thread& client : clients) client.join();
  EXPECT_EQ(bench.runner.list().size(), 3U);
}

TEST(IdentificationRunner, ReportsNoneThatHasNoThread) {
  RunnerBench bench;
  {
    const hapticd::test::RoomForThreads none(0);
    const auto refused = hapticd::test::refusal_of(bench.runner.start(contact_request()));
    EXPECT_EQ(refused.kind, RefusalKind::kResourceExhausted);
    EXPECT_EQ(refused.error.where, "threads");
  }
  EXPECT_TRUE(bench.runner.list().empty());
  EXPECT_FALSE(bench.scenes.reserved());
  EXPECT_TRUE(bench.runner.start(contact_request()));
}

TEST(IdentificationRunner, StartsOneOnly) {
  RunnerBench bench;
  std::atomic<int> started{0};
  std::vector<std::thread> clients;
  for (int i = 0; i < 4; ++i) {
    clients.emplace_back([&] {
      if (bench.runner.start(contact_request())) ++started;
    });
  }
  for (std::thread& client : clients) client.join();
  EXPECT_EQ(started, 1);
}

TEST(IdentificationTask, SaysARemedyThatReachesTheClientWhole) {
  hal::RigInfo rig;
  rig.sensor.model = "nano17";
  const auto refused = hapticd::test::error_of(check_rig(identification::StructuralStiffnessTask{}, rig));
  EXPECT_LE(refused.error.remedy.size(), 300U) << "what is longer is cut on its way";
}

/// Keeps `text` as a recording; its id.
std::string upload(RecordingStore& recordings, const std::string& text) {
  auto upload = recordings.begin({.name = "presses.csv", .columns = {}}, 0.0);
  EXPECT_TRUE(upload);
  EXPECT_FALSE((*upload)->append(text));
  const auto kept = recordings.finish(std::move(*upload));
  EXPECT_TRUE(kept);
  return (*kept)->id;
}

/// Presses of an object that gives by a power law and does not creep, of several depths and speeds, too short
/// and too noisy to see how much creeps.
std::string short_presses() {
  std::string text = "time_s,force_N,position_mm\n";
  std::mt19937_64 random(1);
  std::normal_distribution<double> noise(0.0, 0.1);
  double start_s = 0.0;
  for (int press = 0; press < 4; ++press) {
    const double length_s = 0.2 + 0.4 * press;
    const double deepest_mm = 4.0 + press % 3;
    for (double t = 0.0; t < length_s + 0.3; t += 2e-3) {
      const double x = t < length_s ? deepest_mm * std::sin(3.14159 * t / length_s) : -1.0;
      text += fmt::format("{:.3f},{:.4f},{:.4f}\n", start_s + t,
                          (x > 0.0 ? 0.25 * std::pow(x, 1.2) : 0.0) + noise(random), x);
    }
    start_s += length_s + 0.302;
  }
  return text;
}

TEST(IdentificationRunner, MissesNothingOnceItHasConverged) {
  RunnerBench bench;
  IdentificationRequest request = contact_request();
  request.recording = upload(bench.runner.recordings(), short_presses());
  const auto id = hapticd::test::value_of(bench.runner.start(request));
  IdentificationReport report;
  std::uint64_t version = 0;
  do {
    report = hapticd::test::value_of(bench.runner.report(id, version, patient()));
    version = report.version;
  } while (report.state == IdentificationState::kRunning);
  EXPECT_EQ(report.state, IdentificationState::kConverged);
  EXPECT_TRUE(report.progress.steady && report.progress.certain && report.progress.converged);
  EXPECT_TRUE(report.progress.missing.empty());
  EXPECT_EQ(report.progress.completion, 1.0);
}

/// Long enough that others come while it is read.
std::string upload_long_recording(RecordingStore& recordings) {
  auto upload = recordings.begin({.name = "long.csv", .columns = {}}, 0.0);
  EXPECT_TRUE(upload);
  std::string piece = "time_s,force_N,position_mm\n";
  for (int row = 0; row < 400'000; ++row) {
    piece += fmt::format("{:.3f},{:.3f},{:.3f}\n", 1e-3 * row, 1e-3 * (row % 2000), 2e-3 * (row % 2000));
    if (row % 10'000 != 0) continue;
    EXPECT_FALSE((*upload)->append(piece));
    piece.clear();
  }
  EXPECT_FALSE((*upload)->append(piece));
  const auto kept = recordings.finish(std::move(*upload));
  EXPECT_TRUE(kept);
  return (*kept)->id;
}

TEST(IdentificationRunner, NothingWaitsWhileARecordingIsReadAndItIsGivenUpAtTheEnd) {
  RunnerBench bench;
  IdentificationRequest request = contact_request();
  request.recording = upload_long_recording(bench.runner.recordings());
  bool answered_meanwhile = false;
  for (int attempt = 0; attempt < 200 && !answered_meanwhile; ++attempt) {
    std::atomic<bool> over{false};
    std::thread starting([&] {
      (void)bench.runner.start(request);
      over = true;
    });
    for (int turn = 0; turn < 20 * attempt; ++turn)
      std::this_thread::yield();  // who comes first is left to chance
    // Busy although none is listed as running: its recording is being read, and these calls returned.
    while (!over && !answered_meanwhile) {
      const auto refused = bench.runner.start(contact_request());
      const auto listed = bench.runner.list();
      bench.runner.end_under(7, {"the lease has ended", "lease", "", "", "acquire one"});
      if (refused) {
        (void)bench.runner.cancel(*refused, patient());  // it was first
      } else if (refused.refusal().reason == Reason::kBusy) {
        answered_meanwhile = listed.empty() || listed.front().state != IdentificationState::kRunning;
      }
    }
    if (answered_meanwhile) bench.runner.shutdown();
    starting.join();
    if (!answered_meanwhile) (void)bench.runner.cancel("", patient());
  }
  EXPECT_TRUE(answered_meanwhile);
  for (const IdentificationReport& report : bench.runner.list())
    EXPECT_NE(report.state, IdentificationState::kRunning);
}

}  // namespace
}  // namespace hapticd::server
