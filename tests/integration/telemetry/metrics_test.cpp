// What Prometheus reads: the figures of the loop as they are, on the address that was configured and no
// other.

#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <sstream>
#include <vector>

#include "server/metrics/metrics_server.h"
#include "server/metrics/rig_metrics.h"
#include "tests/integration/running_service.h"
#include "tests/support/http_get.h"
#include "tests/support/system/loopback.h"
#include "tests/support/temporary_folder.h"

namespace hapticd::test {
namespace {

/// Value of the line that begins with `name` (labels included); NaN if there is none.
double metric_in(const std::string& text, const std::string& name) {
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) {
    if (line.starts_with(name + " ")) return std::stod(line.substr(name.size() + 1));
  }
  return std::nan("");
}

server::DaemonConfig config_with_metrics() {
  server::DaemonConfig config = quiet_config();
  config.scene = "tap_1d";
  config.metrics.listen = server::ListenAddress{"127.0.0.1", 0};
  return config;
}

TEST(Metrics, ShowTheLoopTheGuardAndTheSubscribers) {
  const RunningService service(config_with_metrics());
  service.await([](const v1::RigState& s) { return s.tick() > 300; });
  const std::uint16_t port = service.daemon->metrics_port();
  const std::string text = http_get(port, "/metrics");
  EXPECT_GT(metric_in(text, "hapticd_loop_ticks_total"), 300.0) << text;
  EXPECT_EQ(metric_in(text, "hapticd_loop_running"), 1.0);
  EXPECT_EQ(metric_in(text, "hapticd_scene_loaded"), 1.0);
  EXPECT_EQ(metric_in(text, "hapticd_guard_latched"), 0.0);
  EXPECT_EQ(metric_in(text, "hapticd_lease_held"), 0.0);
  EXPECT_EQ(metric_in(text, "hapticd_fault_present{fault=\"stopped\"}"), 0.0);
  EXPECT_EQ(metric_in(text, "hapticd_loop_lateness_seconds_bucket{le=\"+Inf\"}"),
            metric_in(text, "hapticd_loop_lateness_seconds_count"));
  EXPECT_LT(text.size(), 20'000U);
  EXPECT_EQ(http_get(port, "/").find("hapticd_loop"), std::string::npos);

  ASSERT_TRUE(service.stop().ok());
  service.await(is_latched);
  const std::string after = http_get(port, "/metrics");
  EXPECT_EQ(metric_in(after, "hapticd_guard_latched"), 1.0);
  EXPECT_EQ(metric_in(after, "hapticd_guard_latched_by{fault=\"stopped\"}"), 1.0);
}

TEST(Metrics, AreOffUnlessAsked) {
  const RunningService service;
  EXPECT_EQ(service.daemon->metrics_port(), 0);
}

/// A server of these figures. `patience`: how long it waits for a request.
std::unique_ptr<server::MetricsServer> started(std::chrono::milliseconds patience = std::chrono::hours(1),
                                               const server::RigFigures& figures = {}) {
  return std::move(*server::MetricsServer::start(
      {"127.0.0.1", 0}, [figures] { return figures; }, patience));
}

TEST(Metrics, APortThatIsTakenIsNamed) {
  const auto first = started();
  const auto second =
      server::MetricsServer::start({"127.0.0.1", first->port()}, [] { return server::RigFigures{}; });
  ASSERT_FALSE(second);
  EXPECT_EQ(second.error().value, "127.0.0.1:" + std::to_string(first->port()));
  EXPECT_FALSE(second.error().remedy.empty());
}

/// A connection that has sent this, of a request or all of it.
int connection_saying(std::uint16_t port, std::string_view words) {
  const int descriptor = connect_to_loopback(port);
  EXPECT_EQ(send(descriptor, words.data(), words.size(), MSG_NOSIGNAL), static_cast<ssize_t>(words.size()));
  return descriptor;
}

/// True once the other end has closed; waits for it.
bool is_closed(int descriptor) {
  char byte = 0;
  return recv(descriptor, &byte, 1, 0) <= 0;
}

TEST(Metrics, SlowConnectionsKeepNobodyOut) {
  const auto server = started();  // none of them is ended by time
  std::vector<int> slow;
  for (int i = 0; i < 200; ++i) slow.push_back(connection_saying(server->port(), "GET /met"));
  EXPECT_NE(http_get(server->port(), "/metrics").find("hapticd_loop_ticks_total"), std::string::npos);
  EXPECT_TRUE(is_closed(slow.front())) << "the oldest makes room";
  for (const int descriptor : slow) close(descriptor);
}

TEST(Metrics, ASlowConnectionIsClosedInTime) {
  const auto server = started(std::chrono::milliseconds(50));
  const int slow = connection_saying(server->port(), "GET /met");
  EXPECT_TRUE(is_closed(slow));
  close(slow);
}

TEST(Metrics, AClientThatHasClosedItsWritingSideGetsAllOfALargeAnswer) {
  server::RigFigures figures;
  figures.parts.emplace_back();
  for (int i = 0; i < 200'000; ++i)  // some MB: more than the system keeps of what is sent
    figures.parts[0].figures.push_back({"reading_" + std::to_string(i), 1.0, ""});
  const auto server = started(std::chrono::hours(1), figures);
  const int client = connection_saying(server->port(), "GET /metrics HTTP/1.1\r\n\r\n");
  ASSERT_EQ(shutdown(client, SHUT_WR), 0);
  std::string answer;
  std::vector<char> part(1U << 16U);
  for (ssize_t n = 0; (n = recv(client, part.data(), part.size(), 0)) > 0;)
    answer.append(part.data(), static_cast<std::size_t>(n));
  close(client);
  EXPECT_GT(answer.size(), 10'000'000U);
  EXPECT_NE(answer.find("\"reading_199999\""), std::string::npos) << answer.size() << " bytes came";
}

TEST(Metrics, NothingElseIsAnswered) {
  const auto server = started();
  EXPECT_TRUE(http_get(server->port(), "/metrics?name=x").starts_with("HTTP/1.1 200 "));
  EXPECT_TRUE(http_get(server->port(), "/metrics2").starts_with("HTTP/1.1 404 "));
  EXPECT_TRUE(http_get(server->port(), "/" + std::string(9000, 'a')).starts_with("HTTP/1.1 431 "));
}

TEST(Metrics, HistogramsAreThoseOfTheLoop) {
  server::RigFigures figures;
  rt::LatencyHistogram times;
  for (const std::int64_t ns : {500, 3'000, 3'000, 100'000'000}) times.record(ns);
  figures.loop.wakeup = times.snapshot();
  for (const prometheus::MetricFamily& family : server::metric_families(figures)) {
    if (family.name != "hapticd_loop_lateness_seconds") continue;
    const auto& histogram = family.metric.at(0).histogram;
    EXPECT_EQ(histogram.sample_count, 4U);
    EXPECT_NEAR(histogram.sample_sum, 0.1000065, 1e-9);
    for (const auto& bucket : histogram.bucket) {
      const std::uint64_t below = bucket.upper_bound < 3e-6 ? 1U : bucket.upper_bound < 0.1 ? 3U : 4U;
      EXPECT_EQ(bucket.cumulative_count, below) << bucket.upper_bound;
    }
    return;
  }
  FAIL() << "no lateness";
}

TEST(Metrics, HaveTheLeaseAndWhatDriversRead) {
  server::RigFigures figures;
  figures.lease_is_held = true;
  hal::PartReport device;
  device.part = "haptic device";
  device.figures = {{"motor_1_temperature", 0.4, "of the rated temperature"}, {"frames", 17.0, ""}};
  figures.parts = {device};
  int found = 0;
  for (const prometheus::MetricFamily& family : server::metric_families(figures)) {
    if (family.name == "hapticd_lease_held") {
      ++found;
      EXPECT_EQ(family.metric.at(0).gauge.value, 1.0);
    }
    if (family.name != "hapticd_part_figure") continue;
    ++found;
    ASSERT_EQ(family.metric.size(), 2U);
    EXPECT_EQ(family.metric[0].gauge.value, 0.4);
    EXPECT_EQ(family.metric[0].label.at(0).value, "haptic device");
    EXPECT_EQ(family.metric[0].label.at(1).value, "motor_1_temperature");
  }
  EXPECT_EQ(found, 2);
}

TEST(Metrics, PromtoolFindsNothingWrong) {
  if (std::system("command -v promtool >/dev/null 2>&1") != 0) {
    GTEST_SKIP()
        << "promtool is not installed (Debian package prometheus): the form of the metrics is not checked";
  }
  const RunningService service(config_with_metrics());
  service.await([](const v1::RigState& s) { return s.tick() > 50; });
  const std::string answer = http_get(service.daemon->metrics_port(), "/metrics");
  const TemporaryFolder folder;
  const std::string file = folder.path() + "/metrics.txt";
  std::ofstream(file) << answer.substr(answer.find("\r\n\r\n") + 4);
  const std::string command = "promtool check metrics < " + file + " > " + file + ".said 2>&1";
  const int status = std::system(command.c_str());
  const std::string said = file_text(file + ".said");
  EXPECT_EQ(status, 0) << said;
  EXPECT_EQ(said, "");
}

}  // namespace
}  // namespace hapticd::test
