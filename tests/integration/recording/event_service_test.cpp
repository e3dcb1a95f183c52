// What happened on the rig, and how a session of an experiment goes on: for those who watch.

#include <gtest/gtest.h>

#include <algorithm>

#include "client/cpp/client.h"
#include "server/grpc/recording/call_words.h"
#include "tests/integration/running_service.h"

namespace hapticd::test {
namespace {

client::Client client_of(const RunningService& service) {
  return client::Client({.address = service.address(), .timeout = std::chrono::milliseconds(kTimeout)});
}

/// The events of a stream so far, until there is one of these words.
std::vector<v1::RigEvent> until(client::EventStream& stream, const std::string& words) {
  std::vector<v1::RigEvent> seen;
  const auto end = std::chrono::steady_clock::now() + kTimeout;
  while (std::chrono::steady_clock::now() < end) {
    v1::EventBatch batch;
    if (stream.next(batch, std::chrono::milliseconds(100)) != client::EventStream::Event::kMessage) continue;
    seen.insert(seen.end(), batch.events().begin(), batch.events().end());
    if (std::any_of(seen.begin(), seen.end(),
                    [&](const auto& one) { return one.event().text().find(words) != std::string::npos; }))
      return seen;
  }
  ADD_FAILURE() << "no event '" << words << "'";
  return seen;
}

const v1::RigEvent* find(const std::vector<v1::RigEvent>& events, v1::RecordingEventKind kind) {
  const auto found =
      std::find_if(events.begin(), events.end(), [&](const auto& one) { return one.event().kind() == kind; });
  return found == events.end() ? nullptr : &*found;
}

TEST(Events, WhoComesLaterReadsWhatWasBefore) {
  RunningService service(quiet_config());
  client::Client first = client_of(service);
  first.load_scene({.name = "tap_1d"});
  first.stop("too hot");
  first.clear();

  client::Client later = client_of(service);
  client::EventStream stream = later.watch_events({});
  const auto seen = until(stream, "clear, in force");
  ASSERT_FALSE(seen.empty());
  EXPECT_EQ(seen.front().number(), 1U);
  EXPECT_EQ(seen.front().event().kind(), v1::RECORDING_EVENT_KIND_DAEMON);
  const v1::RigEvent* scene = find(seen, v1::RECORDING_EVENT_KIND_SCENE);
  ASSERT_NE(scene, nullptr);
  EXPECT_NE(scene->event().text().find("tap_1d"), std::string::npos);
  EXPECT_FALSE(scene->event().by().empty());
  EXPECT_GT(scene->event().unix_ns(), 0);
  EXPECT_EQ(scene->severity(), v1::EVENT_SEVERITY_INFO);
  int reasons = 0;  // by the service; the stop port carries none
  for (const v1::RigEvent& one : seen) {
    if (one.event().kind() != v1::RECORDING_EVENT_KIND_STOP) continue;
    EXPECT_EQ(one.severity(), v1::EVENT_SEVERITY_WARNING);
    if (one.event().text().find("too hot") != std::string::npos) ++reasons;
  }
  EXPECT_EQ(reasons, 1);

  // And each as it happens.
  first.unload_scene();
  EXPECT_EQ(find(until(stream, "unload scene"), v1::RECORDING_EVENT_KIND_DAEMON), nullptr);
}

TEST(Events, SayCallsInWords) {
  // In a daemon the arguments were printed from a message, so its enumerations are known.
  ASSERT_NE(v1::SetHandProgramRequest::descriptor(), nullptr);
  const std::vector<std::vector<std::string>> cases{
      {"SafetyService/Clear", "", "clear"},
      {"SafetyService/Stop", "by the stop port", "stop by the stop port"},
      {"SafetyService/Stop", R"(reason: "tool change")", R"(stop: reason "tool change")"},
      {"SceneService/LoadScene", R"(name: "tap { kind: X_1d }")", R"(load scene: name "tap { kind: X_1d }")"},
      {"RecordingService/StartRecording", R"(name: "Prüfung \"3\"" decimation: 2)",
       R"(start recording: name "Prüfung \"3\"", decimation 2)"},
      {"SimulationService/SetHandProgram", "program { kind: HAND_PROGRAM_KIND_PRESS force_n: 1.5 }",
       "set hand program: program (kind press, force_n 1.5)"},
      {"RenderingService/SetTarget",
       "law { displacement_profile { knots { value: 1 } knots { value: 2 } } } ramp_s: 0.1",
       "set target: law (displacement_profile (knots (value 1), knots (value 2))), ramp_s 0.1"}};
  for (const auto& one : cases) EXPECT_EQ(server::words_of_call(one[0], one[1]), one[2]);
}

TEST(Events, AreListedByNumberAndKindUpToALimit) {
  RunningService service(quiet_config());
  client::Client client = client_of(service);
  for (int i = 0; i < 5; ++i) client.stop("again");
  v1::ListEventsRequest request;
  request.add_kinds(v1::RECORDING_EVENT_KIND_STOP);
  request.set_max_events(2);
  const auto two = client.events(request);
  ASSERT_EQ(two.events_size(), 2);
  for (const auto& one : two.events()) EXPECT_EQ(one.event().kind(), v1::RECORDING_EVENT_KIND_STOP);
  EXPECT_LT(two.events(0).number(), two.events(1).number());
  request.clear_kinds();
  request.set_max_events(0);
  request.set_after_number(two.events(1).number());
  const auto rest = client.events(request);
  for (const auto& one : rest.events()) EXPECT_GT(one.number(), two.events(1).number());
  request.set_max_events(1001);
  EXPECT_THROW(client.events(request), client::Error);
  // A number of an earlier run, that is still to come in this one.
  v1::WatchEventsRequest watch;
  watch.set_after_number(1'000'000);
  client::EventStream stream = client.watch_events(watch);
  EXPECT_EQ(until(stream, "hapticd").front().number(), 1U);
}

TEST(Experiment, WhoHoldsTheLeaseReportsAndAllMayRead) {
  RunningService service(quiet_config());
  client::Client watcher = client_of(service);
  EXPECT_FALSE(watcher.experiment().has_progress());
  v1::ExperimentProgress progress;
  progress.set_participant("P7");
  progress.set_phase(v1::EXPERIMENT_PHASE_TOUCH);
  progress.set_condition(2);
  progress.set_conditions(5);
  EXPECT_THROW(watcher.report_experiment(progress), client::Error) << "without a lease";
  client::Client runner = client_of(service);
  runner.acquire_lease(v1::AcquireLeaseRequest());
  runner.report_experiment(progress);
  v1::ExperimentState state = watcher.experiment();
  EXPECT_TRUE(state.is_running());
  EXPECT_EQ(state.progress().participant(), "P7");
  EXPECT_FALSE(state.by().empty());
  EXPECT_LT(state.age_s(), 5.0);
  progress.set_phase(v1::EXPERIMENT_PHASE_DONE);
  runner.report_experiment(progress);
  EXPECT_FALSE(watcher.experiment().is_running());
  progress.set_participant(std::string(10'000, 'x'));
  EXPECT_THROW(runner.report_experiment(progress), client::Error);
  EXPECT_EQ(watcher.experiment().progress().participant(), "P7");
}

}  // namespace
}  // namespace hapticd::test
