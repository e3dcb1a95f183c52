// What measures time and goes by it: the interval between ticks, the past of a signal, lags and filters.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

#include "rt/deformation/creep_law.h"
#include "rt/signal/butterworth_low_pass.h"
#include "rt/signal/decay.h"
#include "rt/signal/instant_ring.h"
#include "rt/signal/tick_interval.h"
#include "rt/target/target_blend.h"
#include "rt/target/target_ramp.h"

namespace hapticd::rt {
namespace {

TEST(TickTimer, AGapIsWhatNothingIsKnownOf) {
  TickTimer timer(1000.0);
  EXPECT_TRUE(timer.update(5'000'000).is_gap) << "the first";
  const TickInterval late = timer.update(20'300'000);
  EXPECT_FALSE(late.is_gap);
  EXPECT_NEAR(late.s, 0.0153, 1e-12);
  EXPECT_NEAR(late.periods, 15.3, 1e-9);
  const TickInterval gap = timer.update(220'300'000);
  EXPECT_TRUE(gap.is_gap);
  EXPECT_NEAR(gap.s, 1e-3, 1e-12) << "an estimator starts afresh";
  EXPECT_NEAR(gap.elapsed_periods, 200.0, 1e-9) << "an object forgets all the same";
  EXPECT_TRUE(timer.update(200'000'000).is_gap) << "backwards";
  EXPECT_FALSE(timer.update(200'000'000).is_gap) << "twice the same instant is no gap";
  timer.reset();
  EXPECT_TRUE(timer.update(201'000'000).is_gap);
}

TEST(InstantRing, ReadsBetweenItsValuesAndHoldsItsEnds) {
  InstantRing<double> ring;
  ring.seed(0, 7.0);
  EXPECT_EQ(ring.at(-5), 7.0);
  EXPECT_EQ(ring.at(5), 7.0);
  for (int i = 1; i <= 200; ++i) ring.push(1000 * i, 7.0 + i);
  EXPECT_NEAR(ring.at(199'500), 206.5, 1e-12);
  EXPECT_NEAR(ring.at(150'250), 157.25, 1e-12);
  EXPECT_EQ(ring.at(900'000), 207.0);
  EXPECT_EQ(ring.oldest_ns(), 1000 * (201 - 64));
  EXPECT_EQ(ring.at(0), 7.0 + 201 - 64) << "nothing older is held";
  ring.seed(5, 1.0);
  EXPECT_EQ(ring.at(0), 1.0) << "the past is forgotten";
}

TEST(Decay, IsTheExponentialAroundTheNominalInterval) {
  for (const double time_s : {1e-3, 0.01, 1.0}) {
    const Decay decay(time_s, 1000.0);
    for (const double periods : {0.0, 0.3, 0.98, 1.0, 1.02, 1.7, 16.0, 1e6}) {
      EXPECT_NEAR(decay.over(periods), std::exp(-periods * 1e-3 / time_s), 2e-5) << time_s << " " << periods;
    }
  }
}

TEST(ButterworthLowPass, IrregularTicksLeaveItTheSameFilterInTime) {
  // A sine through the filter, sampled evenly and with a fifth of a period of jitter and gaps of 5 ms.
  const double hz = 8.0;
  const auto input = [hz](double t) { return std::sin(2.0 * std::numbers::pi * hz * t); };
  ButterworthLowPass even(50.0, 1000.0);
  ButterworthLowPass uneven(50.0, 1000.0);
  std::mt19937 random(3);
  std::uniform_real_distribution<double> jitter(-0.2e-3, 0.2e-3);
  double last = 0.0;
  double largest = 0.0;
  std::vector<double> reference;
  for (int i = 0; i < 3000; ++i) reference.push_back(even.update(input(i * 1e-3)));
  even.seed(0.0);
  for (int i = 1; i < 2999; ++i) {
    if (i % 100 >= 95) continue;
    const double t = i * 1e-3 + jitter(random);
    const double output = uneven.update(input(t), (t - last) * 1e3);
    last = t;
    const double at = t * 1e3;
    const auto k = static_cast<std::size_t>(at);
    const double expected = reference[k] + (at - static_cast<double>(k)) * (reference[k + 1] - reference[k]);
    if (i > 300) largest = std::max(largest, std::abs(output - expected));
  }
  EXPECT_LT(largest, 0.05) << "a twentieth, where the gaps leave an eighth of the sine out";
}

TEST(ButterworthLowPass, IsStableForAnyInterval) {
  ButterworthLowPass filter(50.0, 1000.0);
  std::mt19937 random(5);
  std::uniform_real_distribution<double> log_periods(-6.0, 6.0);
  for (int i = 0; i < 100'000; ++i) {
    const double output = filter.update(i % 2 == 0 ? 1.0 : -1.0, std::pow(10.0, log_periods(random)));
    ASSERT_LT(std::abs(output), 4.0) << i;
  }
  for (int i = 0; i < 1000; ++i) filter.update(3.0, 1.0);
  EXPECT_NEAR(filter.output(), 3.0, 1e-9);
}

TEST(TargetRamp, LastsAsLongWithLateTicks) {
  TargetRamp ramp(0.0, 1000.0);
  ramp.set(1.0, 0.1);
  for (int i = 0; i < 10; ++i) ramp.update(5.0);
  EXPECT_NEAR(ramp.value(), 0.5, 1e-12);
  for (int i = 0; i < 10; ++i) ramp.update(5.0);
  EXPECT_EQ(ramp.value(), 1.0);
}

TEST(TargetRamp, OfZeroSecondsEndsAtTheNextTickHoweverSoonThatComes) {
  TargetRamp ramp(0.5, 1000.0);
  ramp.set(0.875, 0.0);
  EXPECT_EQ(ramp.update(0.9, 2.0), 0.875);
  const hal::Vector3 tip_mm;
  TargetLaw law;
  law.stiffness_n_per_mm = 0.5;
  TargetBlend blend(law, 1000.0);
  law.stiffness_n_per_mm = 0.875;
  blend.set(law, 0.0);
  EXPECT_DOUBLE_EQ(blend.update(2.0, 0.0, tip_mm, 0.9), 1.75);
  EXPECT_EQ(blend.stiffness_n_per_mm(), 0.875);
}

TEST(CreepLaw, RemembersByTheMeasuredTime) {
  CreepParameters parameters{.weight = {0.4, 0.1, 0.2, 0.2, 0.1}};
  for (std::size_t j = 0; j < CreepParameters::kKnots; ++j)
    parameters.displacement_mm[j] = 0.1 * static_cast<double>(j);
  CreepLaw even(parameters, 1000.0);
  CreepLaw late(parameters, 1000.0);
  double at_even = 0.0, at_late = 0.0;
  for (int i = 0; i < 3000; ++i) at_even = even.update(0.5).displacement_mm;
  for (int i = 0; i < 30; ++i) at_late = late.update(0.5, 100.0).displacement_mm;
  EXPECT_NEAR(at_late, at_even, 1e-6);
}

}  // namespace
}  // namespace hapticd::rt
