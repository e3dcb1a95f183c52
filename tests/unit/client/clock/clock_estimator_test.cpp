// Bounds of an offset, against a simulation in virtual time that knows it.

#include "client/cpp/clock/clock_estimator.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <string>

#include "client/cpp/clock/clock_converter.h"
#include "client/cpp/error.h"
#include "tests/support/simulated_clocks.h"
#include "tests/support/texts.h"

namespace hapticd::client {
namespace {

using test::SimulatedClocks;

constexpr double kMaxDriftPpm = 200.0;
constexpr std::int64_t kOffsetNs = 7'777'777'777'777'777;
constexpr std::int64_t kMs = 1'000'000;

ClockExchange exchanged(SimulatedClocks& clocks) {
  const test::SimulatedStamps stamps = clocks.exchange();
  return {stamps.client_sent_ns, stamps.daemon_received_ns, stamps.daemon_sent_ns, stamps.client_received_ns};
}

std::string error_of(ClockEstimator& estimator, const ClockExchange& exchange) {
  try {
    estimator.add(exchange);
  } catch (const Error& error) {
    EXPECT_EQ(error.kind(), ErrorKind::kBadClock);
    return error.what();
  }
  return {};
}

/// A network that changes: which way is the slower one, how much it jitters.
void change_network(SimulatedClocks& clocks, int round) {
  constexpr double kUs = 1e3;
  const test::SimulatedDelay fast{20.0 * kUs, 10.0 * kUs, 0.001, 20e6};
  const test::SimulatedDelay slow{400.0 * kUs, 300.0 * kUs, 0.01, 50e6};
  const test::SimulatedDelay none{};
  switch (round % 4) {
    case 0:
      return clocks.set_delays(fast, slow);
    case 1:
      return clocks.set_delays(slow, fast);
    case 2:
      return clocks.set_delays(none, slow);
    default:
      return clocks.set_delays(slow, none);
  }
}

TEST(ClockEstimator, TheTruthIsAlwaysInside) {
  SimulatedClocks clocks(kOffsetNs, kMaxDriftPpm, 1);
  ClockEstimator estimator(kMaxDriftPpm);
  int violations = 0;
  for (int i = 0; i < 1'000'000; ++i) {
    if (i % 10'000 == 0) change_network(clocks, i / 10'000);
    estimator.add(exchanged(clocks));
    const ClockBounds at_once = estimator.bounds(clocks.client_ns());
    if (!clocks.is_offset_within(at_once.lower_ns, at_once.upper_ns)) ++violations;
    clocks.pass(i % 100 == 0 ? 5'000 * kMs : 20 * kMs);
    const ClockBounds later = estimator.bounds(clocks.client_ns());
    if (!clocks.is_offset_within(later.lower_ns, later.upper_ns)) ++violations;
  }
  EXPECT_EQ(violations, 0);
}

TEST(ClockEstimator, BoundsAreNarrowAfterTwoSecondsAndWidenWithAge) {
  SimulatedClocks clocks(-kOffsetNs, kMaxDriftPpm, 2);
  clocks.set_delays({60e3, 40e3, 0.01, 5e6}, {60e3, 40e3, 0.01, 5e6});
  ClockEstimator estimator(kMaxDriftPpm);
  while (clocks.client_ns() < 2'000 * kMs) {
    estimator.add(exchanged(clocks));
    clocks.pass(10 * kMs);
  }
  const double now_ms = estimator.bounds(clocks.client_ns()).bound_ms();
  EXPECT_LT(now_ms, 0.1);
  EXPECT_NEAR(estimator.bounds(clocks.client_ns() + 10'000 * kMs).bound_ms(), now_ms + 2.0, 1e-3);
}

TEST(ClockEstimator, FindsTheDrift) {
  for (const double ppm : {-150.0, 0.0, 37.0}) {
    SimulatedClocks clocks(kOffsetNs, kMaxDriftPpm, 3);
    clocks.fix_drift(ppm);
    clocks.set_delays({50e3, 20e3}, {150e3, 50e3});
    ClockEstimator estimator(kMaxDriftPpm);
    EXPECT_EQ(estimator.drift().bound_ppm, kMaxDriftPpm);
    for (int i = 0; i < 2'000; ++i) {
      estimator.add(exchanged(clocks));
      const ClockDrift drift = estimator.drift();
      ASSERT_LE(std::abs(drift.ppm - ppm), drift.bound_ppm);
      clocks.pass(100 * kMs);
    }
    EXPECT_LT(estimator.drift().bound_ppm, 2.0);
  }
}

TEST(ClockEstimator, NamesAClockThatRunsBackwards) {
  const ClockExchange good{1'000, 5'000, 5'100, 2'000};
  ClockEstimator estimator;
  EXPECT_TRUE(test::holds(error_of(estimator, {1'000, 5'000, 5'100, 999}),
                          "the client's clock ran backwards by 1 ns"));
  EXPECT_TRUE(test::holds(error_of(estimator, {1'000, 5'000, 4'900, 2'000}),
                          "the daemon's clock ran backwards by 100 ns"));
  EXPECT_TRUE(estimator.empty());
  EXPECT_EQ(error_of(estimator, good), "");
  EXPECT_TRUE(test::holds(error_of(estimator, {1'900, 6'000, 6'100, 3'000}), "between two exchanges"));
  EXPECT_TRUE(estimator.empty()) << "what was known is forgotten";
  EXPECT_EQ(error_of(estimator, good), "");
  EXPECT_TRUE(test::holds(error_of(estimator, {3'000, 5'050, 6'100, 4'000}),
                          "the daemon's clock ran backwards by 50 ns"));
}

TEST(ClockEstimator, NoticesThatTheClocksRunApartFasterThanStated) {
  SimulatedClocks clocks(0, kMaxDriftPpm, 4);
  clocks.set_delays({20e3, 0.0}, {20e3, 0.0});
  clocks.fix_drift(1'000.0);
  ClockEstimator estimator(kMaxDriftPpm);
  std::string error;
  for (int i = 0; i < 100 && error.empty(); ++i) {
    error = error_of(estimator, exchanged(clocks));
    clocks.pass(100 * kMs);
  }
  EXPECT_TRUE(test::holds(error, "run apart faster than stated"));
}

TEST(ClockEstimator, BearsAnyNumber) {
  constexpr std::int64_t kMin = std::numeric_limits<std::int64_t>::min();
  constexpr std::int64_t kMax = std::numeric_limits<std::int64_t>::max();
  ClockEstimator estimator;
  for (const std::int64_t absurd : {kMin, kMin + 1, kMax, (std::int64_t{1} << 61U) + 1}) {
    EXPECT_TRUE(test::holds(error_of(estimator, {absurd, 0, 0, kMax}), "no time"));
    EXPECT_TRUE(test::holds(error_of(estimator, {0, absurd, absurd, 0}), "no time"));
  }
  const std::int64_t most = std::int64_t{1} << 61U;
  EXPECT_EQ(error_of(estimator, {-most, most, most, most}), "");
  EXPECT_LE(estimator.bounds(most).lower_ns, estimator.bounds(most).upper_ns);
  for (const double ppm : {0.0, -1.0, 1e5, std::nan(""), std::numeric_limits<double>::infinity()}) {
    EXPECT_THROW(ClockEstimator{ppm}, Error) << ppm;
  }
}

/// Times of a client that asks now and then, also for times of the past and of the near future.
TEST(ClockConverter, NeverJumpsNorRunsBackwardsAndStaysWithinItsBounds) {
  SimulatedClocks clocks(kOffsetNs, kMaxDriftPpm, 5);
  ClockEstimator estimator(kMaxDriftPpm);
  ClockConverter converter;
  std::int64_t last_client_ns = 0;
  std::int64_t last_daemon_ns = 0;
  int backwards = 0;
  int jumps = 0;
  for (int i = 0; i < 200'000; ++i) {
    if (i % 1'000 == 0) change_network(clocks, i / 1'000);
    estimator.add(exchanged(clocks));
    converter.follow(estimator.bounds(clocks.client_ns()), estimator.drift().ppm);
    for (int k = 0; k < 3; ++k) {
      clocks.pass(i % 500 == 0 ? 2'000 * kMs : kMs + k);
      const std::int64_t ahead_ns = i % 7 == 0 ? 66 * kMs : 0;
      const std::int64_t client_ns = std::max(last_client_ns, clocks.client_ns() + ahead_ns);
      const std::int64_t daemon_ns = converter.to_daemon_ns(client_ns);
      if (last_client_ns != 0) {
        const auto passed = static_cast<double>(client_ns - last_client_ns);
        const auto became = static_cast<double>(daemon_ns - last_daemon_ns);
        if (became < 0.0) ++backwards;
        if (std::abs(became - passed) > 1e-6 * (kMaxDriftPpm + ClockConverter::kSlewPpm) * passed + 2.0)
          ++jumps;
      }
      EXPECT_LE(converter.to_daemon_ns(client_ns - 5 * kMs), daemon_ns);
      last_client_ns = client_ns;
      last_daemon_ns = daemon_ns;
    }
  }
  EXPECT_EQ(backwards, 0);
  EXPECT_EQ(jumps, 0);
}

TEST(ClockConverter, CatchesUp) {
  ClockConverter converter;
  EXPECT_TRUE(converter.empty());
  converter.follow({0, 1'000 * kMs, 1'002 * kMs}, 0.0);
  EXPECT_EQ(converter.to_daemon_ns(0), 1'001 * kMs);
  converter.follow({10 * kMs, 1'000 * kMs, 1'000 * kMs}, 0.0);
  EXPECT_EQ(converter.to_daemon_ns(10 * kMs), 1'011 * kMs) << "no jump";
  EXPECT_EQ(converter.to_daemon_ns(1'010 * kMs), 2'010 * kMs + kMs / 2) << "by 500 ppm";
  EXPECT_EQ(converter.to_daemon_ns(2'010 * kMs), 3'010 * kMs) << "there, and no further";
  EXPECT_EQ(converter.to_daemon_ns(3'010 * kMs), 4'010 * kMs);
}

}  // namespace
}  // namespace hapticd::client
