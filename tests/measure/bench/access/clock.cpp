#include "tests/measure/bench/access/clock.h"

#include <chrono>
#include <exception>
#include <memory>
#include <stdexcept>
#include <thread>

#include "client/cpp/clock/clock_sync.h"
#include "tests/measure/bench/access/delaying_proxy.h"
#include "tests/measure/bench/live/daemon_process.h"
#include "tests/support/simulated_clocks.h"

namespace hapticd::bench {
namespace {

constexpr std::chrono::seconds kClockPatience{60};

/// The bound after two seconds. Client and daemon share a clock, so that the truth is known: it is 0.
double bound_after_two_seconds_ms(const std::filesystem::path& logs, bool over_lan) {
  const DaemonProcess daemon(logs / (over_lan ? "hapticd_clock_lan.log" : "hapticd_clock.log"));
  const std::string direct = daemon.address();
  std::unique_ptr<DelayingProxy> proxy;
  if (over_lan) {
    const auto port = std::stoul(direct.substr(direct.rfind(':') + 1));
    proxy = std::make_unique<DelayingProxy>(static_cast<std::uint16_t>(port), WayDelay{0.05, 0.05},
                                            WayDelay{0.15, 0.10});
  }
  double bound_ms = 0.0;
  {
    client::Client client({.address = proxy ? proxy->address() : direct, .timeout = kClockPatience});
    const client::ClockSync clock(client);
    std::this_thread::sleep_for(std::chrono::seconds(2));
    const client::ClockBounds bounds = clock.bounds();
    if (bounds.lower_ns > 0 || bounds.upper_ns < 0) throw std::runtime_error("the truth is outside");
    bound_ms = bounds.bound_ms();
  }
  return bound_ms;
}

/// Networks of which one way is the slower one by far, with jitter and stalls; clocks that drift as far as
/// stated.
int violations_in_simulated_time(int exchanges) {
  constexpr double kMaxDriftPpm = 200.0;
  constexpr int kNetworkLasts = 10'000;
  test::SimulatedClocks clocks(-3'141'592'653'589'793, kMaxDriftPpm, 2026);
  client::ClockEstimator estimator(kMaxDriftPpm);
  const test::SimulatedDelay fast{30e3, 20e3, 0.001, 10e6};
  const test::SimulatedDelay slow{500e3, 400e3, 0.01, 40e6};
  int violations = 0;
  for (int i = 0; i < exchanges; ++i) {
    if (i % kNetworkLasts == 0) {
      const bool turned = i / kNetworkLasts % 2 == 1;
      clocks.set_delays(turned ? slow : fast, turned ? fast : slow);
    }
    const test::SimulatedStamps stamps = clocks.exchange();
    estimator.add(
        {stamps.client_sent_ns, stamps.daemon_received_ns, stamps.daemon_sent_ns, stamps.client_received_ns});
    clocks.pass(i % 1000 == 0 ? 10'000'000'000 : 50'000'000);
    const client::ClockBounds bounds = estimator.bounds(clocks.client_ns());
    if (!clocks.is_offset_within(bounds.lower_ns, bounds.upper_ns)) ++violations;
  }
  return violations;
}

template <class Measure>
report::Figure measured_clock(report::Figure figure, Measure measure) {
  try {
    figure.value = measure();
  } catch (const std::exception& error) {
    figure.failed = error.what();
  }
  return figure;
}

}  // namespace

void add_clock_figures(const std::filesystem::path& logs, bool quick,
                       const std::function<void(const std::string&, const report::Figure&)>& add) {
  for (const bool over_lan : {false, true}) {
    const char* path = over_lan ? "lan" : "loopback";
    add(std::string("clock_bound_ms, ") + path,
        measured_clock({.figure = "clock_bound_ms",
                        .conditions = {{"path", path}},
                        .unit = "ms",
                        .goal = over_lan ? 0.3 : 0.1},
                       [&] { return bound_after_two_seconds_ms(logs, over_lan); }));
  }
  const int exchanges = quick ? 100'000 : 1'000'000;
  add("clock_violations, " + std::to_string(exchanges) + " simulated exchanges",
      measured_clock({.figure = "clock_violations", .goal = 0.0},
                     [&] { return violations_in_simulated_time(exchanges); }));
}

}  // namespace hapticd::bench
