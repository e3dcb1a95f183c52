#include "rt/guard/fault_table.h"

#include <gtest/gtest.h>

#include <cstdint>
#include <fstream>
#include <limits>
#include <sstream>
#include <string>
#include <utility>

#include "rt/guard/guard.h"

namespace hapticd::rt {
namespace {

constexpr double kLoopHz = 1000.0;
constexpr double kWantedN = 2.0;
constexpr int kFallTicks = 100;
constexpr int kResumeTicks = 200;

GuardLimits fault_limits() {
  GuardLimits l;
  l.max_force_n = 8.5;
  l.max_force_rate_n_per_s = 1e5;
  l.sensor_stale_after_ms = 2.0;
  l.resume_ramp_s = kResumeTicks / kLoopHz;
  l.fall_ramp_s = kFallTicks / kLoopHz;
  l.loop_gap_ms = 50.0;
  return l;
}

/// A guard with 2 N wanted all the time and faults that come and go.
class Bench {
 public:
  Bench() {
    for (int i = 0; i < 10; ++i) tick();
  }

  /// One tick with a fault present, however it is noticed; kNone: a fit sample.
  double tick(GuardFault fault = GuardFault::kNone) {
    hal::RigSample sample;
    time_ns_ += 1'000'000;
    if (fault == GuardFault::kLoopGap) time_ns_ += 60'000'000;
    if (fault == GuardFault::kSensorStale) sample.force_age_ns = 2'100'000;
    if (fault == GuardFault::kNonFinite) sample.sensor_force_n.x = std::numeric_limits<double>::quiet_NaN();
    if (fault != GuardFault::kNone) {
      sample.status = rule_of(fault).sample_status;
      if (raised_only(fault)) guard_.raise(fault);
    }
    sample.time_ns = time_ns_;
    record_ = TickRecord{};
    Admission admission = guard_.admit(sample, noticed_only(fault) ? set_of(fault) : 0);
    fit_ = admission.is_fit();
    const double force_n = guard_.release(std::move(admission), {0.0, 0.0, kWantedN}, 0).z;
    guard_.fill_record(record_);
    return force_n;
  }

  static bool raised_only(GuardFault fault) {
    return fault == GuardFault::kStopped || (fault >= GuardFault::kTurntableMoving && !noticed_only(fault));
  }
  /// True for faults noticed by a pipeline, from tick to tick.
  static bool noticed_only(GuardFault fault) {
    return fault == GuardFault::kSensorZeroFar || fault == GuardFault::kSensorZeroLost ||
           fault == GuardFault::kSensorJumped || fault == GuardFault::kSensorFrozen ||
           fault == GuardFault::kStructureSwings;
  }

  Guard& guard() { return guard_; }
  const TickRecord& record() const { return record_; }
  bool fit() const { return fit_; }

 private:
  Guard guard_{fault_limits(), kLoopHz};
  TickRecord record_;
  std::int64_t time_ns_ = 0;
  bool fit_ = true;
};

/// Runs a test of one fault on each line of the table.
void expect_of_every_fault(void (*test)(const FaultRule&)) {
  for (const FaultRule& rule : kFaultTable) {
    SCOPED_TRACE(rule.name);
    test(rule);
  }
}

void expect_the_action(const FaultRule& rule) {
  Bench bench;
  ASSERT_EQ(bench.tick(), kWantedN);
  double force_n = bench.tick(rule.fault);
  EXPECT_EQ(bench.fit(), !rule.unfit);
  EXPECT_EQ(bench.record().faults_present, set_of(rule.fault));
  switch (rule.action) {
    case FaultAction::kWarn:
      EXPECT_EQ(force_n, kWantedN);
      EXPECT_EQ(bench.record().guard_state, GuardState::kRendering);
      EXPECT_EQ(bench.record().guard_fault, GuardFault::kNone);
      return;
    case FaultAction::kCut:
      EXPECT_EQ(force_n, 0.0);
      break;
    case FaultAction::kRampToZero:
      for (int i = 1; i < kFallTicks; ++i) {
        EXPECT_NEAR(force_n, kWantedN * (1.0 - static_cast<double>(i) / kFallTicks), 1e-9);
        EXPECT_FALSE(bench.guard().force_is_zero());
        force_n = bench.tick(rule.fault);
      }
      EXPECT_NEAR(force_n, 0.0, 1e-9);
      break;
  }
  EXPECT_EQ(bench.record().guard_fault, rule.fault);
}

TEST(EveryFault, ActsOnTheForceAsTheTableSays) {
  expect_of_every_fault(expect_the_action);
}

void expect_the_end(const FaultRule& rule) {
  if (rule.action == FaultAction::kWarn) return;
  Bench bench;
  for (int i = 0; i < 2 * kFallTicks; ++i) bench.tick(rule.fault);
  EXPECT_TRUE(bench.guard().force_is_zero());
  if (rule.clearing == FaultClearing::kAnyClient) {
    if (!Bench::raised_only(rule.fault)) {
      EXPECT_FALSE(bench.guard().clear()) << "while its cause lasts";
    }
    for (int i = 0; i < 1000; ++i) ASSERT_EQ(bench.tick(), 0.0) << "no one has cleared";
    EXPECT_EQ(bench.record().guard_state, GuardState::kLatched);
    EXPECT_EQ(bench.record().faults_present, 0U);
    EXPECT_TRUE(bench.guard().clear());
  } else {
    EXPECT_EQ(bench.record().guard_state, GuardState::kSuspended);
  }
  double before_n = 0.0;
  for (int i = 0; i < kResumeTicks; ++i) {
    const double force_n = bench.tick();
    EXPECT_NEAR(force_n - before_n, kWantedN / kResumeTicks, 1e-9) << "comes back over a ramp";
    before_n = force_n;
  }
  EXPECT_NEAR(bench.tick(), kWantedN, 1e-9);
  EXPECT_EQ(bench.record().guard_state, GuardState::kRendering);
}

TEST(EveryFault, EndsAsTheTableSays) {
  expect_of_every_fault(expect_the_end);
}

TEST(EveryFault, OfTheSensorConcernsOnlyScenesThatListenToIt) {
  expect_of_every_fault([](const FaultRule& rule) {
    Bench bench;
    GuardLimits deaf = fault_limits();
    deaf.sensor_stale_after_ms = 0.0;
    bench.guard().set_limits(deaf);
    const bool concerns = !rule.of_sensor && rule.fault != GuardFault::kNonFinite;
    bench.tick(rule.fault);
    EXPECT_EQ(bench.record().faults_present, concerns ? set_of(rule.fault) : 0U);
  });
}

TEST(FaultTable, TheFirstLatchingCauseIsTheOneReported) {
  Bench bench;
  bench.tick(GuardFault::kSensorFault);
  bench.tick(GuardFault::kDeviceFault);
  EXPECT_EQ(bench.record().guard_fault, GuardFault::kSensorFault);
  EXPECT_EQ(bench.record().faults_present, set_of(GuardFault::kDeviceFault));
}

TEST(FaultTable, ACutOvertakesARamp) {
  Bench bench;
  EXPECT_GT(bench.tick(GuardFault::kDeviceWarm), 0.0);
  EXPECT_EQ(bench.tick(GuardFault::kSensorFault), 0.0);
  EXPECT_EQ(bench.record().guard_fault, GuardFault::kDeviceWarm);
}

TEST(FaultTable, ALatchOvertakesASuspension) {
  Bench bench;
  bench.tick(GuardFault::kLoopGap);
  EXPECT_EQ(bench.record().guard_state, GuardState::kSuspended);
  bench.tick(GuardFault::kDeviceFault);
  EXPECT_EQ(bench.record().guard_state, GuardState::kLatched);
  EXPECT_EQ(bench.record().guard_fault, GuardFault::kDeviceFault);
}

TEST(FaultTable, EveryDriversStatusBitHasALine) {
  std::uint32_t covered =
      hal::sample_status::kForceMissing;  // one tick without a sample is reported by its age
  for (const FaultRule& rule : kFaultTable) {
    EXPECT_EQ(covered & rule.sample_status, 0U) << rule.name << ": a bit means one fault";
    covered |= rule.sample_status;
  }
  EXPECT_EQ(covered, 2 * hal::sample_status::kCommandStale - 1);
}

TEST(FaultTable, TheDocumentationPrintsIt) {
  std::ifstream file(HAPTICD_SOURCE_DIR "/docs/faults.md");
  std::stringstream page;
  page << file.rdbuf();
  EXPECT_NE(page.str().find(fault_table_markdown()), std::string::npos) << "docs/faults.md is to contain:\n"
                                                                        << fault_table_markdown();
}

}  // namespace
}  // namespace hapticd::rt
