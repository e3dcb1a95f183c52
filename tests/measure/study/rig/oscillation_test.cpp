#include "tests/measure/study/common/oscillation.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/measure/study/common/van_der_pol.h"

namespace hapticd::study {
namespace {

constexpr double kRateHz = 1000.0;

/// Judges four seconds of a position signal.
template <class Signal>
bool oscillates(Signal signal) {
  OscillationJudge judge(kRateHz);
  for (int i = 0; i < 4000; ++i) judge.add(signal(i / kRateHz));
  return judge.oscillates();
}

TEST(OscillationJudge, KnowsAVanDerPolLimitCycle) {
  for (const double start : {0.01, 3.0}) {
    OscillationJudge judge(kRateHz);
    van_der_pol(start, 4000, [&](double position_mm) { judge.add(position_mm); });
    EXPECT_TRUE(judge.oscillates());
    // The line taken out of a window that cuts through a cycle tilts it a little.
    EXPECT_NEAR(judge.peak_to_peak(), 1.0, 0.1);
  }
}

TEST(OscillationJudge, LetsASlowStableModePass) {
  EXPECT_FALSE(oscillates([](double t) { return -6.0 + 4.0 * std::exp(-t / 1.5); }))
      << "creep over millimetres";
  EXPECT_FALSE(oscillates([](double t) { return std::exp(-2.0 * t) * std::sin(40.0 * t); }))
      << "rings, but dies away";
  EXPECT_FALSE(oscillates([](double t) { return 0.04 * std::sin(60.0 * t); })) << "hand tremor";
}

TEST(OscillationJudge, CatchesGrowthAndTheCycleThatStays) {
  EXPECT_TRUE(oscillates([](double t) { return 1e-3 * std::exp(2.0 * t) * std::sin(80.0 * t); }));
  EXPECT_TRUE(oscillates([](double t) { return 0.06 * std::sin(80.0 * t); }));
  EXPECT_TRUE(oscillates([](double t) { return 2.0 * t + 0.06 * std::sin(80.0 * t); }))
      << "on top of a drift";
}

}  // namespace
}  // namespace hapticd::study
