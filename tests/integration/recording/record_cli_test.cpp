// hapticctl record and hapticctl incident.

#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>

#include "server/recording/flight/incident.h"
#include "tests/integration/running_service.h"
#include "tests/support/child_process.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/value_of.h"

namespace hapticd::test {
namespace {

class RecordCli : public testing::Test {
 protected:
  Ran run(std::vector<std::string> words) const {
    words.insert(words.begin(), {"--server", service_.address()});
    return run_to_the_end(HAPTICCTL_BINARY, std::move(words));
  }

  void await_ticks(std::uint64_t count) const {
    const std::uint64_t until = service_.state().tick() + count;
    service_.await([until](const v1::RigState& state) { return state.tick() > until; });
  }

  const TemporaryFolder folder_;
  const RunningService service_{config_that_records(folder_.path("state"))};
};

TEST_F(RecordCli, RecordsFetchesExportsAndDeletes) {
  const Ran started = run({"--json", "record", "start", "press", "--note", "a note"});
  ASSERT_EQ(started.code, 0) << started.errors;
  const std::string id = nlohmann::json::parse(started.output).at("id");
  EXPECT_TRUE(id.ends_with("_press"));
  EXPECT_NE(run({"record", "start"}).code, 0) << "one at a time";
  EXPECT_EQ(run({"record", "annotate", "here"}).code, 0);
  EXPECT_NE(run({"status"}).output.find(id), std::string::npos);
  await_ticks(300);
  const Ran stopped = run({"record", "stop"});
  EXPECT_EQ(stopped.code, 0) << stopped.errors;
  EXPECT_NE(stopped.output.find("none lost"), std::string::npos) << stopped.output;
  EXPECT_NE(run({"record", "list"}).output.find("a note"), std::string::npos);

  const std::string mcap = folder_.path("a.mcap");
  EXPECT_EQ(run({"record", "get", "last", "--out", mcap}).code, 0);
  EXPECT_GT(std::filesystem::file_size(mcap), 1000U);
  for (const char* name : {"a.h5", "a.csv"}) {
    const Ran exported = run({"record", "export", "last", "--out", folder_.path(name)});
    EXPECT_EQ(exported.code, 0) << exported.errors;
    EXPECT_EQ(exported.output.find("replaced"), std::string::npos) << exported.output;
    EXPECT_GT(std::filesystem::file_size(folder_.path(name)), 1000U);
  }
  const Ran again = run({"record", "export", "last", "--out", folder_.path("a.csv")});
  EXPECT_EQ(again.code, 0) << again.errors;
  EXPECT_NE(again.output.find("; the file that was there is replaced\n"), std::string::npos) << again.output;
  const Ran wrong = run({"record", "export", "last", "--out", folder_.path("b.csv"), "--columns", "forse"});
  EXPECT_NE(wrong.code, 0);
  EXPECT_NE(wrong.errors.find("the recording has no such column"), std::string::npos) << wrong.errors;
  EXPECT_FALSE(std::filesystem::exists(folder_.path("b.csv"))) << "nothing is left of what was refused";
  const Ran no_format = run({"record", "export", "last", "--out", folder_.path("b.xls")});
  EXPECT_NE(no_format.errors.find(".h5, .hdf5 or .csv"), std::string::npos) << no_format.errors;
  EXPECT_EQ(run({"record", "delete", id}).code, 0);
  EXPECT_NE(run({"record", "get", id}).code, 0);
}

TEST_F(RecordCli, WritesNoFormatUnderTheNameOfAnother) {
  const auto expect_refused = [this](std::vector<std::string> words, const std::string& name,
                                     const std::string& accepted) {
    const std::string path = folder_.path(name);
    words.push_back(path);
    const Ran refused = run(words);
    EXPECT_EQ(refused.code, 2) << path;
    EXPECT_NE(refused.errors.find(accepted), std::string::npos) << refused.errors;
    EXPECT_FALSE(std::filesystem::exists(path)) << path;
  };
  const std::vector<std::string> telemetry{"telemetry", "record", "--samples", "10"};
  for (const char* name : {"a.h5", "a.hdf5", "a.mcap"}) expect_refused(telemetry, name, "ends in .csv");
  for (const char* name : {"a.csv", "a.h5"})
    expect_refused({"incident", "get", "last", "--out"}, name, "ends in .mcap");
  expect_refused({"identify", "watch", "--svg"}, "a.png", "ends in .svg");
  for (const std::string& path : {folder_.path("a.txt"), std::string("/dev/null")})
    EXPECT_EQ(run({"telemetry", "record", "--samples", "10", path}).code, 0) << path;
  const Ran again = run({"telemetry", "record", "--samples", "10", folder_.path("a.txt")});
  EXPECT_NE(again.output.find("replaced"), std::string::npos) << again.output;

  const auto program = std::filesystem::path(HAPTICCTL_BINARY).parent_path() / "hapticd-export";
  ChildProcess exported(program.string(), {folder_.path("a.mcap"), "--out", folder_.path("b.mcap")});
  EXPECT_NE(exported.wait(), 0);
  EXPECT_NE(exported.errors().find("the format is not known"), std::string::npos) << exported.errors();
  EXPECT_EQ(ChildProcess(program.string(), {"a.mcap", "--no-such-option"}).wait(), 2);
  EXPECT_EQ(ChildProcess(program.string(), {}).wait(), 2);
}

/// The curves of a plot: what gnuplot drew, without its title.
std::string curves_of(const std::string& svg) {
  std::ifstream file(svg);
  std::string curves;
  for (std::string line; std::getline(file, line);) {
    if (line.find("<path") != std::string::npos) curves += line + '\n';
  }
  return curves;
}

TEST_F(RecordCli, PlotsARecordingOfAnyKindAlike) {
  if (std::system("command -v gnuplot > /dev/null") != 0) {
    GTEST_SKIP() << "SKIPPED LOUDLY: gnuplot is not installed, so no plot was drawn";
  }
  ASSERT_EQ(run({"scene", "load", "tap_1d"}).code, 0);
  ASSERT_EQ(run({"record", "start", "press"}).code, 0);
  const Ran pressed = run({"sim", "hand", "press", "--force", "1", "--hold", "0.2", "--wait"});
  EXPECT_EQ(pressed.code, 0) << pressed.errors;
  EXPECT_FALSE(service_.state().in_contact()) << "the hand was waited for";
  ASSERT_EQ(run({"record", "stop"}).code, 0);
  ASSERT_EQ(run({"record", "get", "last", "--out", folder_.path("a.mcap")}).code, 0);
  std::vector<std::string> drawn;
  for (const char* name : {"a.h5", "a.csv"})
    ASSERT_EQ(run({"record", "export", "last", "--out", folder_.path(name)}).code, 0);
  for (const char* name : {"a.mcap", "a.h5", "a.csv"}) {
    const std::string svg = folder_.path(std::string(name) + ".svg");
    const Ran plotted = run({"plot", folder_.path(name), "--out", svg});
    ASSERT_EQ(plotted.code, 0) << plotted.errors;
    EXPECT_NE(plotted.output.find("samples drawn"), std::string::npos) << plotted.output;
    drawn.push_back(curves_of(svg));
  }
  EXPECT_GT(drawn[0].size(), 2000U);
  EXPECT_EQ(drawn[1], drawn[0]);
  EXPECT_EQ(drawn[2], drawn[0]);

  const std::string cut = folder_.path("cut.mcap");
  std::ofstream(cut, std::ios::binary) << "\x89MCAP0\r\n"
                                       << "nothing";
  const Ran refused = run({"plot", cut, "--out", folder_.path("cut.svg")});
  EXPECT_EQ(refused.code, 2);
  EXPECT_NE(refused.errors.find(cut), std::string::npos) << refused.errors;
}

TEST_F(RecordCli, ShowsAnIncidentInWordsAndAsAPicture) {
  ASSERT_EQ(run({"scene", "load", "tap_1d"}).code, 0);
  await_ticks(500);
  ASSERT_EQ(run({"stop", "--reason", "tool change"}).code, 0);
  service_.await(
      [](const v1::RigState& state) { return state.last_incident().find("_stopped") != std::string::npos; });
  EXPECT_NE(run({"incident", "list"}).output.find("_stopped"), std::string::npos);
  EXPECT_NE(run({"status"}).output.find("last incident"), std::string::npos);
  const std::string svg = folder_.path("incident.svg");
  const Ran shown = run({"incident", "show", "last", "--out", svg});
  if (std::system("command -v gnuplot > /dev/null") != 0) {
    GTEST_SKIP() << "SKIPPED LOUDLY: gnuplot is not installed, so no plot was drawn";
  }
  ASSERT_EQ(shown.code, 0) << shown.errors;
  EXPECT_NE(shown.output.find("cause   stopped: zero force"), std::string::npos) << shown.output;
  EXPECT_NE(shown.output.find("tool change"), std::string::npos) << shown.output;
  const std::string text = file_text(svg);
  EXPECT_NE(text.find("to the device / N"), std::string::npos);
  EXPECT_NE(text.find("tip / mm"), std::string::npos);
}

TEST_F(RecordCli, ShowsWhatThereIsOfAnIncidentWhoseTicksAreLost) {
  // Ticks of the first half second; the cause comes 20 s later.
  constexpr std::int64_t kTicks = 500;
  const std::vector<recording::Column> columns{
      {"tick", "1", true}, {"time_ns", "ns", true}, {"force_n", "N", false}};
  const auto ring = value_of(server::FlightRing::create(folder_.path("r.ring"), columns, kTicks, 1000.0));
  std::string rows;
  for (std::int64_t tick = 0; tick < kTicks; ++tick) {
    recording::put(tick, rows);
    recording::put(1'000'000 * tick, rows);
    recording::put(0.5, rows);
  }
  demand(ring->write(rows));
  server::RecordingSources sources;
  sources.block_schema = sources.event_schema = "schema";
  server::Incident incident;
  incident.cause = "sensor_stale";
  incident.words = "the sensor is silent";
  incident.remedy = "look at its cable";
  incident.tick = 20'000;
  incident.time_ns = 20'000'000'000;
  const std::string incidents = folder_.path("state/incidents/");
  const auto shown = [&](const std::string& id) {
    demand(server::write_incident(incident, *ring, sources, {}, incidents + id + ".mcap"));
    const Ran ran = run({"incident", "show", id});
    EXPECT_EQ(ran.code, 0) << ran.errors;
    return ran.output;
  };
  incident.row_count = kTicks;
  const std::string some = shown("00001_20260101T000000Z_sensor_stale");
  for (const char* part : {"cause   the sensor is silent", "remedy  look at its cable",
                           "missing the ticks around the cause are lost"}) {
    EXPECT_NE(some.find(part), std::string::npos) << part << " in\n" << some;
  }
  incident.row_count = 0;
  const std::string none = shown("00002_20260101T000000Z_sensor_stale");
  EXPECT_NE(none.find("cause   the sensor is silent"), std::string::npos) << none;
  EXPECT_NE(none.find("missing its ticks: "), std::string::npos) << none;
}

TEST(TelemetryRecordCli, EndsWithTheRecordingThatIsReplayed) {
  const TemporaryFolder folder;
  server::DaemonConfig config = config_that_replays(
      folder.write("run.csv", "time_s,force_N,indentation_mm\n0,0,0\n0.001,0.1,0.01\n0.002,0.2,0.02\n"));
  config.replay.loop = false;
  const RunningService service(config);
  service.await([](const v1::RigState& state) { return state.rig_exhausted(); });
  ChildProcess recorder(HAPTICCTL_BINARY,
                        {"--server", service.address(), "telemetry", "record", folder.path("late.csv")});
  EXPECT_EQ(recorder.wait(), 4) << "no sample came";
  EXPECT_NE(recorder.output().find("the recording that is replayed has ended"), std::string::npos)
      << recorder.output() << recorder.errors();
}

}  // namespace
}  // namespace hapticd::test
