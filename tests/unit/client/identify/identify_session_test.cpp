#include "client/cli/identify/identify_session.h"

#include <gtest/gtest.h>

#include <csignal>
#include <nlohmann/json.hpp>
#include <sstream>
#include <thread>

#include "client/cli/commands/commands.h"
#include "client/cli/identify/identify_task.h"
#include "client/cli/identify/identify_view.h"
#include "tests/support/value_of.h"
#include "tests/unit/client/identify/identify_fake_service.h"

namespace hapticd::cli {
namespace {

using std::chrono::milliseconds;
using test::contact_end;
using test::contact_progress;
using test::IdentifyFakeService;

std::vector<v1::IdentificationProgress> run_to(v1::IdentificationState state, int steps = 6) {
  std::vector<v1::IdentificationProgress> all;
  for (int i = 0; i < steps; ++i) all.push_back(contact_progress(i / static_cast<double>(steps)));
  all.push_back(contact_end(state));
  return all;
}

/// Never over by itself.
std::vector<v1::IdentificationProgress> endless() {
  return {contact_progress(0.1), contact_progress(0.5)};
}

struct Outcome {
  ExitCode exit_code = ExitCode::kOk;
  std::string output;
};

/// What `act` prints and how it exits; Ctrl-C is not pressed unless the options say so.
Outcome outcome_of(const IdentifyFakeService& fake, const std::function<void(IdentifySession&)>& act,
                   IdentifyOptions options = {}, bool json = false) {
  Session session{.server = fake.address(), .json = json};
  if (!options.user_request) options.user_request = [] { return UserRequest::kGoOn; };
  testing::internal::CaptureStdout();
  try {
    IdentifySession identify(session, std::move(options));
    act(identify);
  } catch (...) {
    testing::internal::GetCapturedStdout();
    throw;
  }
  return {session.exit_code, testing::internal::GetCapturedStdout()};
}

void start(IdentifySession& identify) {
  IdentifyTask task;
  task.object = "sponge";
  identify.start(start_request(IdentifyKind::kContact, task), "", {});
}

bool holds(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
}

TEST(IdentifySession, EndsWithAModel) {
  const IdentifyFakeService fake({.progress = run_to(v1::IDENTIFICATION_STATE_CONVERGED)});
  const Outcome outcome = outcome_of(fake, start);
  EXPECT_EQ(outcome.exit_code, ExitCode::kOk);
  EXPECT_TRUE(holds(outcome.output, "contact-7 runs")) << outcome.output;
  EXPECT_TRUE(holds(outcome.output, "> Press deeper than 6 mm")) << outcome.output;
  EXPECT_TRUE(holds(outcome.output, "converged after 20.0 s")) << outcome.output;
  EXPECT_TRUE(holds(outcome.output, "hapticctl model show 3f9a12bc77aa")) << outcome.output;
  ASSERT_EQ(fake.started().size(), 1U);
  EXPECT_EQ(fake.watched_names(), std::vector<std::string>{"contact-7"});
  EXPECT_EQ(fake.cancelled(), 0);
}

TEST(IdentifySession, TheExitCodeSaysHowItEnded) {
  const std::pair<v1::IdentificationState, ExitCode> cases[] = {
      {v1::IDENTIFICATION_STATE_PARTIAL, ExitCode::kNotConverged},
      {v1::IDENTIFICATION_STATE_CANCELLED, ExitCode::kNotConverged},
      {v1::IDENTIFICATION_STATE_FAILED, ExitCode::kRefused}};
  for (const auto& [state, code] : cases) {
    const IdentifyFakeService fake({.progress = run_to(state, 1)});
    EXPECT_EQ(outcome_of(fake, start).exit_code, code);
  }
}

TEST(IdentifySession, CtrlCCancelsAndSaysWhatWasKept) {
  const IdentifyFakeService fake({.progress = endless()});
  IdentifyOptions options;
  options.user_request = [&fake] { return fake.watched() > 0 ? UserRequest::kCancel : UserRequest::kGoOn; };
  const Outcome outcome = outcome_of(fake, start, options);
  EXPECT_EQ(fake.cancelled(), 1);
  EXPECT_EQ(outcome.exit_code, ExitCode::kNotConverged);
  EXPECT_TRUE(holds(outcome.output, "cancelled")) << outcome.output;
  EXPECT_TRUE(holds(outcome.output, "model show cccccccccccc")) << outcome.output;
}

TEST(IdentifySession, TheSignalItselfCancels) {
  const IdentifyFakeService fake({.progress = endless()});
  Session session{.server = fake.address()};
  std::thread user([&fake] {
    while (fake.watched() == 0) std::this_thread::sleep_for(milliseconds(2));
    std::raise(SIGINT);
  });
  testing::internal::CaptureStdout();
  IdentifySession identify(session, {});
  start(identify);
  user.join();
  testing::internal::GetCapturedStdout();
  EXPECT_EQ(fake.cancelled(), 1);
  EXPECT_EQ(session.exit_code, ExitCode::kNotConverged);
}

TEST(IdentifySession, AClientThatIsTerminatedLeavesItRunning) {
  const IdentifyFakeService fake({.progress = endless()});
  IdentifyOptions options;
  options.user_request = [&fake] { return fake.watched() > 0 ? UserRequest::kLeave : UserRequest::kGoOn; };
  const Outcome outcome = outcome_of(fake, start, options);
  EXPECT_EQ(fake.cancelled(), 0);
  EXPECT_TRUE(holds(outcome.output, "contact-7 goes on")) << outcome.output;
}

TEST(IdentifySession, WatchingAndCtrlCLeavesItRunning) {
  const IdentifyFakeService fake({.progress = endless()});
  IdentifyOptions options;
  int asked = 0;
  options.user_request = [&asked] { return ++asked > 3 ? UserRequest::kCancel : UserRequest::kGoOn; };
  const Outcome outcome = outcome_of(
      fake, [](IdentifySession& identify) { identify.watch(""); }, options);
  EXPECT_EQ(fake.cancelled(), 0);
  EXPECT_EQ(outcome.exit_code, ExitCode::kOk);
  EXPECT_TRUE(holds(outcome.output, "contact-7 goes on; end it: hapticctl identify cancel contact-7"))
      << outcome.output;
}

grpc::Status explained_end() {
  v1::ErrorDetail detail;
  detail.set_what("the daemon ends");
  return IdentifyFakeService::refusal(grpc::StatusCode::UNAVAILABLE, detail);
}

/// How a stream can end in the middle of an identification.
struct BreakCase {
  const char* name;
  grpc::Status status;
  friend void PrintTo(const BreakCase& broken, std::ostream* out) { *out << broken.name; }
};
class IdentifyBreak : public testing::TestWithParam<BreakCase> {};

TEST_P(IdentifyBreak, IsResumed) {
  const IdentifyFakeService fake({.progress = run_to(v1::IDENTIFICATION_STATE_CONVERGED, 60),
                                  .break_after = 3,
                                  .break_status = GetParam().status,
                                  .streams_that_break = 2});
  testing::internal::CaptureStderr();
  const Outcome outcome = outcome_of(fake, [](IdentifySession& identify) { identify.watch(""); });
  EXPECT_TRUE(holds(testing::internal::GetCapturedStderr(), "connection lost"));
  EXPECT_EQ(outcome.exit_code, ExitCode::kOk);
  // Whichever ran at first is the one that is watched on.
  EXPECT_EQ(fake.watched_names(), (std::vector<std::string>{"", "contact-7", "contact-7"}));
}

INSTANTIATE_TEST_SUITE_P(
    Streams, IdentifyBreak,
    testing::Values(BreakCase{"socket_closed", {grpc::StatusCode::UNAVAILABLE, "Socket closed"}},
                    BreakCase{"cancelled_by_the_server",
                              {grpc::StatusCode::CANCELLED, "the server shuts down"}},
                    BreakCase{"daemon_that_says_it_ends", explained_end()},
                    BreakCase{"closed_in_good_order", grpc::Status::OK}),
    [](const testing::TestParamInfo<BreakCase>& one) { return std::string(one.param.name); });

TEST(IdentifySession, ADaemonThatIsAwayForAWhileIsWaitedFor) {
  IdentifyFakeService fake({.progress = run_to(v1::IDENTIFICATION_STATE_CONVERGED, 200)});
  std::thread network([&fake] {
    while (fake.watched() == 0) std::this_thread::sleep_for(milliseconds(2));
    std::this_thread::sleep_for(milliseconds(50));
    fake.disconnect();
    std::this_thread::sleep_for(milliseconds(400));
    fake.listen();
  });
  testing::internal::CaptureStderr();
  const Outcome outcome = outcome_of(fake, start);
  network.join();
  testing::internal::GetCapturedStderr();
  EXPECT_EQ(outcome.exit_code, ExitCode::kOk);
  EXPECT_TRUE(holds(outcome.output, "converged")) << outcome.output;
  EXPECT_GE(fake.watched(), 2);
  EXPECT_EQ(fake.started().size(), 1U);  // resumed, not begun again
}

TEST(IdentifySession, ADaemonThatStaysAwayEndsTheSession) {
  IdentifyFakeService fake({.progress = endless()});
  std::thread network([&fake] {
    while (fake.watched() == 0) std::this_thread::sleep_for(milliseconds(2));
    fake.disconnect();
  });
  IdentifyOptions options{.timeout = milliseconds(300)};
  testing::internal::CaptureStderr();
  const client::Error error = test::thrown_by<client::Error>([&] { outcome_of(fake, start, options); });
  EXPECT_EQ(error.kind(), client::ErrorKind::kUnreachable);
  network.join();
  testing::internal::GetCapturedStderr();
}

TEST(IdentifyFollow, AStreamThatFallsSilentIsResumed) {
  const IdentifyFakeService fake(
      {.progress = run_to(v1::IDENTIFICATION_STATE_CONVERGED, 80), .silent_after = 3});
  client::Client client({.address = fake.address()});
  IdentifyFollow follow;
  follow.connect = [&fake] { return client::Client({.address = fake.address()}); };
  follow.silence = milliseconds(120);
  follow.pause = milliseconds(10);
  bool noticed = false;
  follow.on_idle = [&noticed](const std::string& notice) { noticed = noticed || !notice.empty(); };
  v1::IdentificationProgress last;
  follow.on_progress = [&last](const v1::IdentificationProgress& progress) { last = progress; };
  EXPECT_EQ(follow_identification(client, "contact-7", follow), IdentifyEnd::kOver);
  EXPECT_EQ(last.state(), v1::IDENTIFICATION_STATE_CONVERGED);
  EXPECT_EQ(fake.watched(), 2);
  EXPECT_TRUE(noticed);
}

TEST(IdentifySession, ARefusalIsNotTriedAgain) {
  v1::ErrorDetail detail;
  detail.set_what("there is no identification of that name");
  detail.set_value("contact-99");
  const IdentifyFakeService fake(
      {.watch_refusal = IdentifyFakeService::refusal(grpc::StatusCode::NOT_FOUND, detail)});
  const client::Error error = test::thrown_by<client::Error>(
      [&] { outcome_of(fake, [](IdentifySession& identify) { identify.watch("contact-99"); }); });
  EXPECT_EQ(error.code(), "NOT_FOUND");
  EXPECT_EQ(error.detail().value(), "contact-99");
  EXPECT_EQ(fake.watched(), 1);
}

TEST(IdentifySession, ARefusedStartIsReported) {
  v1::ErrorDetail detail;
  detail.set_what("another identification runs");
  const IdentifyFakeService fake(
      {.start_refusal = IdentifyFakeService::refusal(grpc::StatusCode::FAILED_PRECONDITION, detail)});
  EXPECT_THROW(outcome_of(fake, start), client::Error);
  EXPECT_EQ(fake.watched(), 0);
}

TEST(IdentifySession, JsonIsALineAProgressAndTheLastOneSaysTheEnd) {
  const IdentifyFakeService fake({.progress = run_to(v1::IDENTIFICATION_STATE_PARTIAL)});
  const Outcome outcome = outcome_of(fake, start, {}, true);
  EXPECT_EQ(outcome.exit_code, ExitCode::kNotConverged);
  std::istringstream lines(outcome.output);
  Json last;
  int count = 0;
  int over = 0;
  for (std::string line; std::getline(lines, line); ++count) {
    last = Json::parse(line);
    if (last["state"] != "running") ++over;
  }
  EXPECT_GT(count, 1);
  EXPECT_EQ(over, 1);
  EXPECT_EQ(last["state"], "partial");
  EXPECT_EQ(last["parameters"][0]["name"], "stiffness");
}

TEST(IdentifySession, ACancelledOneEndsInJsonToo) {
  const IdentifyFakeService fake({.progress = endless()});
  IdentifyOptions options;
  options.user_request = [&fake] { return fake.watched() > 0 ? UserRequest::kCancel : UserRequest::kGoOn; };
  const Outcome outcome = outcome_of(fake, start, options, true);
  const auto begin = outcome.output.rfind('\n', outcome.output.size() - 2);
  const Json last = Json::parse(outcome.output.substr(begin == std::string::npos ? 0 : begin + 1));
  EXPECT_EQ(last["state"], "cancelled");
}

TEST(IdentifySession, ARecordingIsUploadedAndIdentifiedOn) {
  const IdentifyFakeService fake({.progress = run_to(v1::IDENTIFICATION_STATE_CONVERGED, 1)});
  const test::TemporaryFolder folder;
  const std::string path = folder.write("cycle.csv", "time_s,force_n\n0,1\n");
  const Outcome outcome = outcome_of(fake, [&path](IdentifySession& identify) {
    IdentifyTask task;
    task.object = "silicone";
    task.recording_path = path;
    identify.start(start_request(IdentifyKind::kContact, task), path, recording_description(task));
  });
  EXPECT_EQ(outcome.exit_code, ExitCode::kOk);
  EXPECT_TRUE(holds(outcome.output, "cycle.csv: 1234 rows, 1.2 s, is recording-3")) << outcome.output;
  EXPECT_TRUE(holds(outcome.output, "2 gaps of more than 5 ms were left out")) << outcome.output;
  ASSERT_EQ(fake.started().size(), 1U);
  EXPECT_EQ(fake.started()[0].recording(), "recording-3");
  EXPECT_EQ(fake.pieces()[0].description().name(), "cycle.csv");
}

TEST(IdentifySession, CancelEndsWhatRunsAndIsDone) {
  const IdentifyFakeService fake({.progress = endless()});
  const Outcome outcome = outcome_of(fake, [](IdentifySession& identify) { identify.cancel(""); });
  EXPECT_EQ(outcome.exit_code, ExitCode::kOk);
  EXPECT_EQ(fake.cancelled(), 1);
  EXPECT_TRUE(holds(outcome.output, "cancelled after")) << outcome.output;
}

TEST(IdentifySession, ListShowsTheLastOnes) {
  const IdentifyFakeService fake(
      {.progress = {contact_progress(0.5), contact_end(v1::IDENTIFICATION_STATE_CONVERGED)}});
  const Outcome outcome = outcome_of(fake, [](IdentifySession& identify) { identify.list(); });
  EXPECT_TRUE(holds(outcome.output, "contact of sponge")) << outcome.output;
  EXPECT_TRUE(holds(outcome.output, "running")) << outcome.output;
  EXPECT_TRUE(holds(outcome.output, "3f9a12bc77aa")) << outcome.output;
}

TEST(IdentifySession, ListShowsNoNumbersOfEarlierRunsOfTheDaemon) {
  v1::IdentificationProgress earlier;
  earlier.set_identification("contact-3");
  earlier.set_kind("contact");
  earlier.set_object("sponge");
  earlier.set_state(v1::IDENTIFICATION_STATE_CONVERGED);
  const IdentifyFakeService fake({.progress = {earlier}});
  const Outcome outcome = outcome_of(fake, [](IdentifySession& identify) { identify.list(); });
  EXPECT_TRUE(holds(outcome.output, "contact-3")) << outcome.output;
  EXPECT_FALSE(holds(outcome.output, "0 %")) << outcome.output;
  EXPECT_FALSE(holds(outcome.output, "0.0")) << outcome.output;
  for (const bool live : {false, true}) {
    std::string all;
    if (live) {
      for (const auto& line : identify_frame(earlier, "", {})) all += line + "\n";
    } else {
      for (const auto& line : identify_report(earlier, false, {})) all += line + "\n";
    }
    EXPECT_FALSE(holds(all, "steady") || holds(all, "0 samples") || holds(all, "0 %")) << all;
  }
}

TEST(IdentifySession, FitAndCoverageAreDrawnAtTheEnd) {
  if (std::system("command -v gnuplot > /dev/null") != 0) GTEST_SKIP() << "gnuplot is not installed";
  const IdentifyFakeService fake({.progress = run_to(v1::IDENTIFICATION_STATE_PARTIAL, 1)});
  const test::TemporaryFolder folder;
  IdentifyOptions options{.svg = folder.path("fit.svg")};
  const Outcome outcome = outcome_of(fake, start, options);
  EXPECT_EQ(outcome.exit_code, ExitCode::kNotConverged);
  const std::string text = test::file_text(options.svg);
  for (const char* words : {"<svg", "</svg>", "displacement / mm"}) EXPECT_TRUE(holds(text, words)) << words;
}

}  // namespace
}  // namespace hapticd::cli
