// Everything that may go wrong between gauges and sample, and that it is over when it is over.

#include <gtest/gtest.h>

#include <cmath>

#include "daq_bench.h"
#include "tests/support/part_report.h"
#include "tests/support/value_of.h"

namespace hapticd::daq {
namespace {

using test::DaqBench;
namespace status = hal::sample_status;

class DaqSensorFault : public testing::Test {
 protected:
  void SetUp() override {
    bench.engage();
    bench.board->feed({1.0, 2.0, 3.0}, {});
    for (int k = 0; k < 5; ++k) bench.tick();
    ASSERT_EQ(bench.tick().status, 0U);
  }
  void expect_well_again() {
    hal::RigSample sample = bench.tick();
    sample = bench.tick();
    EXPECT_EQ(sample.status, 0U);
    EXPECT_EQ(sample.force_count, 10U);
    EXPECT_NEAR(sample.sensor_force_n.z, 3.0, 0.005);
  }
  bool finds(const std::string& text) const { return test::shows(bench.sensor->report(), text); }
  double figure(const std::string& name) const { return test::figure_of(bench.sensor->report(), name); }
  DaqBench bench;
};

TEST_F(DaqSensorFault, ALateScanIsMissingAndItsAgeGrows) {
  bench.board->mute_scans();
  bench.tick();
  const hal::RigSample first = bench.tick();
  EXPECT_NE(first.status & status::kForceMissing, 0U);
  EXPECT_EQ(first.status & status::kForceLost, 0U);
  EXPECT_NEAR(first.sensor_force_n.z, 3.0, 0.005) << "the last mean is kept";
  EXPECT_GE(first.force_age_ns, 1'000'000);
  const hal::RigSample later = bench.tick();
  EXPECT_GE(later.force_age_ns, first.force_age_ns + 1'000'000);
  EXPECT_GT(figure("silent_ticks"), 0.0);
  bench.board->mute_scans(false);
  expect_well_again();
}

TEST_F(DaqSensorFault, AStoppedAcquisitionIsLost) {
  bench.board->stop_scans();
  const hal::RigSample sample = bench.tick();
  EXPECT_NE(sample.status & status::kForceLost, 0U);
  EXPECT_EQ(bench.sensor->report().state, hal::PartState::kConnecting);
  EXPECT_TRUE(finds("no scans arrive"));
  bench.board->stop_scans(false);
  expect_well_again();
  EXPECT_EQ(bench.sensor->report().state, hal::PartState::kReady);
}

TEST_F(DaqSensorFault, ABoardThatIsGoneIsLostAndMayComeBack) {
  bench.board->vanish();
  EXPECT_NE(bench.tick().status & status::kForceLost, 0U);
  for (int k = 0; k < 50; ++k) EXPECT_NE(bench.tick().status & status::kForceLost, 0U);
  bench.board->vanish(false);
  expect_well_again();
}

TEST_F(DaqSensorFault, ABoardThatIsGoneCannotBeEngaged) {
  bench.sensor->disengage();
  bench.board->vanish();
  EXPECT_FALSE(test::error_of(bench.sensor->engage()).remedy.empty());
  EXPECT_EQ(bench.read().status, status::kForceMissing);
}

TEST_F(DaqSensorFault, AnOverrunWarnsOnce) {
  bench.pass_ms(1.0);
  bench.board->lose_scans(4);
  const hal::RigSample sample = bench.read();
  EXPECT_EQ(sample.status, status::kForceWarning);
  EXPECT_EQ(sample.force_count, 6U);
  EXPECT_EQ(figure("overruns"), 1.0);
  EXPECT_TRUE(finds("scans were lost"));
  expect_well_again();
}

TEST_F(DaqSensorFault, ATickThatWasAwayGetsTheNewestScansNotItsAbsence) {
  bench.pass_ms(300.0);
  bench.board->feed({1.0, 2.0, -4.0}, {});
  bench.pass_ms(20.0);
  const hal::RigSample sample = bench.read();
  EXPECT_EQ(sample.force_count, 128U);
  EXPECT_NEAR(sample.sensor_force_n.z, -4.0, 0.005);
}

TEST_F(DaqSensorFault, VoltsThatAreNoNumbersAreAFaultAndNeverAForce) {
  bench.board->put_nan();
  hal::RigSample sample = bench.tick();
  EXPECT_NE(sample.status & status::kForceFault, 0U);
  EXPECT_NE(sample.status & status::kForceMissing, 0U);
  EXPECT_TRUE(std::isfinite(sample.sensor_force_n.z));
  EXPECT_EQ(bench.sensor->report().state, hal::PartState::kFaulty);
  EXPECT_EQ(figure("unfit_scans"), 10.0);
  bench.board->repair_gauges();
  expect_well_again();
}

TEST_F(DaqSensorFault, SomeThatAreNoNumbersAreAWarning) {
  bench.pass_ms(0.5);
  bench.board->feed({1.0, 2.0, 3.0}, {});  // fixes the scans up to here
  bench.board->put_nan();
  bench.pass_ms(0.5);
  const hal::RigSample sample = bench.read();
  EXPECT_EQ(sample.status, status::kForceWarning);
  EXPECT_EQ(sample.force_count, 5U);
  EXPECT_NEAR(sample.sensor_force_n.z, 3.0, 0.005);
}

TEST_F(DaqSensorFault, AGaugeAtEitherRailIsSaturated) {
  for (const double rail_v : {10.0, -10.0, 9.85, -9.85}) {
    bench.board->put_rail(2, rail_v);
    EXPECT_EQ(bench.tick().status, status::kForceSaturated) << rail_v;
    bench.board->repair_gauges();
    expect_well_again();
  }
  bench.board->put_rail(2, 9.75);
  EXPECT_EQ(bench.tick().status, 0U) << "98 % of 10 V is not reached";
}

TEST_F(DaqSensorFault, OneSaturatedScanOfTenIsEnough) {
  bench.pass_ms(0.9);
  bench.board->feed({1.0, 2.0, 3.0}, {});
  bench.board->put_rail(4, 10.0);
  bench.pass_ms(0.1);
  const hal::RigSample sample = bench.read();
  EXPECT_EQ(sample.force_count, 10U);
  EXPECT_EQ(sample.status, status::kForceSaturated);
}

TEST_F(DaqSensorFault, ALoadBeyondTheRangeSaturatesRatherThanLies) {
  bench.board->feed({0.0, 0.0, 200.0}, {});
  EXPECT_EQ(bench.tick().status, status::kForceSaturated);
}

TEST_F(DaqSensorFault, AScriptedFaultHappensAtItsTime) {
  const std::int64_t now_ns = bench.board->now_ns();
  bench.board->at_ns(now_ns + 5'500'000, [](auto& board) { board.stop_scans(); });
  bench.board->at_ns(now_ns + 9'500'000, [](auto& board) { board.stop_scans(false); });
  std::string seen;
  for (int k = 0; k < 12; ++k) seen += (bench.tick().status & status::kForceLost) != 0 ? 'x' : '.';
  EXPECT_EQ(seen, ".....xxxx...");
}

TEST(DaqSensorEngage, ABoardWithoutScansIsRefusedInTime) {
  DaqBench bench({}, {.engage_timeout_s = 0.1});
  bench.board->mute_scans();
  const auto error = test::error_of(bench.sensor->engage());
  EXPECT_NE(error.what.find("no scans"), std::string::npos) << error.text();
  EXPECT_FALSE(bench.board->engaged(BoardUse::kInputs)) << "nothing stays open";
}

}  // namespace
}  // namespace hapticd::daq
