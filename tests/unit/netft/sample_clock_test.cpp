#include "hal/sample_clock.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <random>
#include <vector>

#include "hal/netft/rdt_continuity.h"

namespace hapticd::hal {
namespace {

constexpr std::int64_t kDelayNs = 120'000;

struct Arrival {
  std::uint32_t number = 0;
  std::int64_t taken_ns = 0;
  std::int64_t arrival_ns = 0;
};

/// Samples taken evenly, taken over in bunches: every few milliseconds, and now and then only after a stall.
std::vector<Arrival> bunched(double rate_hz, double seconds, std::uint32_t first = 0) {
  std::mt19937_64 random(4);
  std::uniform_real_distribution<double> any(0.0, 1.0);
  std::vector<Arrival> all;
  double look_ns = 0.0;
  const auto count = static_cast<std::uint32_t>(seconds * rate_hz);
  for (std::uint32_t i = 0; i < count; ++i) {
    const double taken_ns = 1e9 * i / rate_hz;
    while (look_ns < taken_ns + kDelayNs) look_ns += any(random) < 0.01 ? 3e7 : 1e5 + 2e6 * any(random);
    all.push_back({first + i, static_cast<std::int64_t>(taken_ns), static_cast<std::int64_t>(look_ns)});
  }
  return all;
}

/// Largest error of the instants, the smallest delay apart, after `settled_s`; ns.
double worst_ns(SampleClock& clock, const std::vector<Arrival>& arrivals, double settled_s) {
  double worst = 0.0;
  for (const Arrival& a : arrivals) {
    const std::int64_t instant = clock.instant_ns(a.number, a.arrival_ns);
    EXPECT_LE(instant, a.arrival_ns) << "nothing arrives before it was taken";
    if (1e-9 * static_cast<double>(a.taken_ns) < settled_s) continue;
    worst = std::max(worst, std::abs(static_cast<double>(instant - a.taken_ns - kDelayNs)));
  }
  return worst;
}

TEST(SampleClock, SamplesThatArriveInBunchesWereTakenEvenly) {
  SampleClock clock(7000.0);
  EXPECT_LT(worst_ns(clock, bunched(7000.0, 20.0), 0.2), 200e3);
}

TEST(SampleClock, FollowsASourceThatIsNotQuiteAtItsRate) {
  for (const double share : {1.0 - 1e-3, 1.0 + 1e-3, 1.0 - 1e-4}) {
    SampleClock clock(7000.0);
    EXPECT_LT(worst_ns(clock, bunched(7000.0 * share, 20.0), 5.0), 250e3) << share;
  }
}

TEST(SampleClock, MeasuresARateThatNoOneSaysOrSaysWrongly) {
  for (const double reported_hz : {0.0, 1000.0, 10000.0}) {
    SampleClock clock(reported_hz);
    EXPECT_LT(worst_ns(clock, bunched(7000.0, 20.0), 8.0), 400e3) << reported_hz;
  }
}

TEST(SampleClock, GoesOnAcrossTheWrapAndAfterARestart) {
  SampleClock clock(7000.0);
  EXPECT_LT(worst_ns(clock, bunched(7000.0, 5.0, 0xffff'f000U), 0.2), 200e3);
  clock.restart();
  EXPECT_EQ(clock.instant_ns(3, 77'000'000'000), 77'000'000'000);
}

TEST(SampleClock, NoticesNumbersAheadOfTime) {
  SampleClock clock(1000.0);
  for (std::uint32_t i = 0; i < 1000; ++i) {
    clock.instant_ns(i, 1'000'000LL * i);
    EXPECT_LT(clock.ahead_ns(), 1.0);
  }
  clock.instant_ns(6000, 1'000'000'000);
  EXPECT_NEAR(clock.ahead_ns(), 5e9, 1e6);
  clock.instant_ns(6001, 1'001'000'000);
  EXPECT_LT(clock.ahead_ns(), 1e4);
  clock.instant_ns(9001, 4'002'000'000);  // as many missing as there was time for
  EXPECT_LT(clock.ahead_ns(), 1e6);
}

TEST(RdtContinuity, OneRestartIsForgivenTheSecondWithinTenSecondsIsNot) {
  netft::RdtContinuity continuity;
  constexpr std::int64_t kS = 1'000'000'000;
  EXPECT_FALSE(continuity.note_restart(100 * kS));
  EXPECT_FALSE(continuity.note_restart(111 * kS));
  EXPECT_TRUE(continuity.note_restart(120 * kS));
  continuity.note_request();
  EXPECT_FALSE(continuity.note_restart(121 * kS)) << "asked for";
  EXPECT_TRUE(continuity.note_restart(122 * kS)) << "once";
}

TEST(RdtContinuity, NumbersAheadOfTimeAreAFaultWhetherAtOnceOrLittleByLittle) {
  netft::RdtContinuity continuity;
  EXPECT_FALSE(continuity.note_ahead(0.9e9, 1'000'000'000));
  EXPECT_TRUE(continuity.note_ahead(0.2e9, 1'100'000'000));
  EXPECT_TRUE(continuity.note_ahead(1.1e9, 5'000'000'000));
  for (int i = 0; i < 100; ++i) {
    EXPECT_FALSE(continuity.note_ahead(2e7, 10'000'000'000 + 1'000'000'000LL * i)) << "a little is forgotten";
  }
}

}  // namespace
}  // namespace hapticd::hal
