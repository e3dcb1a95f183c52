#include "tests/measure/bench/realtime/command_latency.h"

#include <grpcpp/grpcpp.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <csignal>
#include <fstream>
#include <iostream>
#include <stdexcept>
#include <thread>
#include <vector>

#include "client/cpp/client.h"
#include "hapticd/v1/rendering.grpc.pb.h"
#include "tests/measure/bench/live/daemon_process.h"
#include "tests/measure/report/quantile.h"

namespace hapticd::bench {
namespace {

using report::quantile;

using Clock = std::chrono::steady_clock;

constexpr double kTickUs = 1000.0;
constexpr double kGoalEchoes = 1.5;

class EchoService final : public v1::RenderingService::Service {
 public:
  grpc::Status SetTarget(grpc::ServerContext*, const v1::SetTargetRequest* request,
                         v1::SetTargetResponse* response) override {
    response->set_requested_n_per_mm(request->stiffness_n_per_mm());
    response->set_granted_n_per_mm(request->stiffness_n_per_mm());
    response->set_limiting_reason(v1::LIMITING_REASON_NONE);
    response->set_effective_tick(123456);
    response->set_effective_time_ns(123456000000);
    return grpc::Status::OK;
  }
};

/// Server in a separate process.
class EchoProcess {
 public:
  explicit EchoProcess(const std::filesystem::path& log)
      : process_({.command = {(program_folder() / "hapticd_bench").string(), "echo-child"}, .output = log}) {
    const auto deadline = Clock::now() + std::chrono::seconds(20);
    while (address_.empty()) {
      std::this_thread::sleep_for(std::chrono::milliseconds(20));
      std::string line;
      std::ifstream file(log);
      if (std::getline(file, line) && !file.eof()) address_ = line;
      if (Clock::now() > deadline) throw std::runtime_error("the echo server did not say where it listens");
    }
  }
  ~EchoProcess() { process_.signal(SIGTERM); }
  const std::string& address() const noexcept { return address_; }

 private:
  report::ChildProcess process_;
  std::string address_;
};

/// Round trips in µs, at times that fall anywhere in a period of the loop.
std::vector<double> round_trips(const std::string& address, int calls) {
  client::Client client({.address = address});
  std::vector<double> times;
  double phase = 0.0;
  for (int i = 0; i < calls + 50; ++i) {
    v1::SetTargetRequest request;
    request.set_stiffness_n_per_mm(i % 2 == 0 ? 0.3 : 0.35);
    const auto start = Clock::now();
    client.set_target(request);
    const std::chrono::duration<double, std::micro> took = Clock::now() - start;
    if (i >= 50) times.push_back(took.count());  // the first ones warm up
    phase = std::fmod(phase + 0.618034, 1.0);
    std::this_thread::sleep_for(std::chrono::duration<double, std::micro>(500.0 + kTickUs * phase));
  }
  std::sort(times.begin(), times.end());
  return times;
}

report::PlotSeries curve(const std::string& label, const std::vector<double>& sorted) {
  report::PlotSeries series;
  series.name = label;
  for (std::size_t i = 0; i < sorted.size(); i += std::max<std::size_t>(1, sorted.size() / 400)) {
    series.add(sorted[i], static_cast<double>(i) / static_cast<double>(sorted.size() - 1));
  }
  return series;
}

}  // namespace

void measure_command_latency(report::Report& report, const RealtimeOptions& options) {
  const std::filesystem::path folder = report.folder() / "realtime";
  std::filesystem::create_directories(folder);
  const int calls = options.quick ? 200 : 3000;
  std::vector<double> effect;
  std::vector<double> echo;
  {
    const DaemonProcess daemon(folder / "hapticd_command.log");
    const EchoProcess server(folder / "echo.log");
    // By turns, so that both meet the same machine.
    constexpr int kTurns = 5;
    for (int turn = 0; turn < kTurns; ++turn) {
      for (auto* times : {&echo, &effect}) {
        const auto& address = times == &echo ? server.address() : daemon.address();
        const auto some = round_trips(address, calls / kTurns);
        times->insert(times->end(), some.begin(), some.end());
      }
    }
  }
  std::sort(effect.begin(), effect.end());
  std::sort(echo.begin(), echo.end());

  report::MarkdownTable table(
      {"quantile", "command to effect [µs]", "echo [µs]", "one tick + 1.5 echo [µs]"});
  for (const double share : {0.5, 0.9, 0.99, 0.999}) {
    const double bound_us = kTickUs + kGoalEchoes * quantile(echo, share);
    report::Figure figure{.figure = "command_to_effect_us",
                          .conditions = {{"quantile", share}},
                          .value = quantile(effect, share),
                          .unit = "us",
                          .source = "one tick + 1.5 x the echo of the same size"};
    if (share == 0.5) figure.goal = bound_us;
    report.add(figure);
    report.add({.figure = "echo_us",
                .conditions = {{"quantile", share}},
                .value = quantile(echo, share),
                .unit = "us"});
    table.add_row({report::significant(share), report::fixed(quantile(effect, share), 0),
                   report::fixed(quantile(echo, share), 0), report::fixed(bound_us, 0)});
  }
  report.add_table(
      "realtime_command", "From a command to its effect", table,
      std::to_string(effect.size()) +
          " calls of SetTarget each, by turns, from another process over loopback TCP, at times "
          "that fall anywhere in a period. The answer "
          "comes after the tick at which the target took effect, so that the way back is counted "
          "too: an upper bound. Echo: the same messages, a server that answers at once.");
  report::Plot plot;
  plot.title = "From a command to its effect, next to an echo";
  plot.x = {"time from call to answer", "µs", true};
  plot.y = {"share of calls"};
  plot.series = {curve("target set, in effect", effect), curve("echo", echo)};
  report.add_plot("realtime_command", plot, {.height_px = 360});
}

int run_echo_child() {
  EchoService service;
  grpc::ServerBuilder builder;
  int port = 0;
  builder.AddListeningPort("127.0.0.1:0", grpc::InsecureServerCredentials(), &port);
  builder.RegisterService(&service);
  const auto server = builder.BuildAndStart();
  if (server == nullptr) return 1;
  std::cout << "127.0.0.1:" << port << std::endl;
  server->Wait();  // until a signal ends the process
  return 0;
}

}  // namespace hapticd::bench
