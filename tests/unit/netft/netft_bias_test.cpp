// Zero of the sensor: what sets it, and what is left of it when the box restarts.

#include <gtest/gtest.h>

#include "netft_bench.h"
#include "tests/support/value_of.h"

namespace hapticd::netft {
namespace {

namespace status = hal::sample_status;

constexpr std::uint16_t kBiasCommand = 0x42;

/// Reads until a sample has arrived that satisfies the condition.
bool reads(NetFtBench& bench, const std::function<bool(const hal::RigSample&)>& condition) {
  return eventually([&] { return condition(bench.read()); });
}

bool near(double value, double wanted) {
  return std::abs(value - wanted) < 2e-6;
}

TEST(NetFtBias, InSoftwareIsTheMeanAndIsTakenInTheToolsAxes) {
  NetFtBench bench;
  bench.config.axes = "+y -x +z";
  bench.box.set_offset({0.5, -0.25, 2.0}, {10.0, 20.0, 30.0});
  ASSERT_FALSE(bench.engage());
  ASSERT_TRUE(reads(bench, [](const auto& s) { return near(s.sensor_force_n.x, -0.25); }));
  const auto error = bench.sensor->bias();
  ASSERT_FALSE(error) << error->text();
  EXPECT_TRUE(reads(bench, [](const auto& s) { return s.force_count > 0 && near(s.sensor_force_n.z, 0.0); }));
  bench.box.load({1.0, 2.0, 3.0}, {40.0, 0.0, 0.0});
  EXPECT_TRUE(reads(bench, [](const auto& s) {
    return near(s.sensor_force_n.x, 2.0) && near(s.sensor_force_n.y, -1.0) && near(s.sensor_force_n.z, 3.0) &&
           std::abs(s.sensor_torque_n_mm.y + 40.0) < 2e-3;
  }));
  EXPECT_EQ(bench.box.commands(kBiasCommand), 0);
}

TEST(NetFtBias, OnTheBoxIsCommandedAndChecked) {
  NetFtBench bench;
  bench.config.bias = BiasBy::kBox;
  bench.box.set_offset({0.5, -0.25, 2.0}, {10.0, 20.0, 30.0});
  ASSERT_FALSE(bench.engage());
  const auto error = bench.sensor->bias();
  ASSERT_FALSE(error) << error->text();
  EXPECT_EQ(bench.box.commands(kBiasCommand), 1);
  EXPECT_TRUE(reads(bench, [](const auto& s) { return near(s.sensor_force_n.z, 0.0); }));
}

TEST(NetFtBias, OnABoxThatDoesNotHearItIsAnErrorAfterSomeAttempts) {
  NetFtBench bench;
  bench.config.bias = BiasBy::kBox;
  bench.box.set_offset({0.0, 0.0, 2.0}, {});
  ASSERT_FALSE(bench.engage());
  bench.box.set_deaf(true);
  const auto deaf = test::error_of(bench.sensor->bias());
  EXPECT_NE(deaf.text().find("did not apply the bias"), std::string::npos) << deaf.text();
  bench.box.set_deaf(false);
  EXPECT_FALSE(bench.sensor->bias());
}

TEST(NetFtBias, IsRefusedWhenSwitchedOffNotEngagedOrSilent) {
  NetFtBench bench;
  bench.config.bias = BiasBy::kNone;
  ASSERT_FALSE(bench.engage());
  const auto off = bench.sensor->bias();
  ASSERT_TRUE(off);
  EXPECT_EQ(off->what, "biasing is switched off");

  bench.config.bias = BiasBy::kSoftware;
  ASSERT_FALSE(bench.engage());
  bench.box.set_silent(true);
  bench.settle();
  EXPECT_NE(test::error_of(bench.sensor->bias()).what.find("too few samples"), std::string::npos);

  bench.sensor->disengage();
  EXPECT_EQ(test::error_of(bench.sensor->bias()).value, "not engaged");
}

TEST(NetFtBias, IsRefusedWhileTheSensorIsSaturated) {
  NetFtBench bench;
  ASSERT_FALSE(bench.engage());
  bench.box.load({30.0, 0.0, 0.0}, {});
  ASSERT_TRUE(reads(bench, [](const auto& s) { return (s.status & status::kForceSaturated) != 0; }));
  EXPECT_NE(test::error_of(bench.sensor->bias()).what.find("saturated"), std::string::npos);
}

TEST(NetFtBias, OfABoxThatRestartedIsReportedLostAndNeverSetAgainByItself) {
  NetFtBench bench;
  bench.config.bias = BiasBy::kBox;
  bench.box.set_offset({0.0, 0.0, 2.0}, {});
  ASSERT_FALSE(bench.engage());
  ASSERT_FALSE(bench.sensor->bias());
  ASSERT_TRUE(reads(bench, [](const auto& s) { return s.status == 0 && near(s.sensor_force_n.z, 0.0); }));
  EXPECT_EQ(bench.read().bias_serial, 1U);

  bench.box.restart(0.5);
  ASSERT_TRUE(eventually([&] { return bench.figure("box_restarts") == 1.0; }));
  ASSERT_TRUE(reads(bench, [](const auto& s) { return s.force_count > 0 && near(s.sensor_force_n.z, 2.0); }));
  EXPECT_TRUE(eventually([&] { return bench.finds("its earlier bias is lost"); }));
  EXPECT_TRUE(reads(bench, [](const auto& s) { return s.bias_serial == 2; })) << "the loss counts";
  EXPECT_NE(bench.read().status & status::kForceWarning, 0U);
  EXPECT_EQ(bench.box.commands(kBiasCommand), 1);

  ASSERT_FALSE(bench.sensor->bias());
  EXPECT_FALSE(bench.finds("is lost"));
  EXPECT_TRUE(reads(bench, [](const auto& s) { return s.status == 0 && near(s.sensor_force_n.z, 0.0); }));
}

TEST(NetFtBias, OfAnotherClientIsNoticedAndNamed) {
  for (const BiasBy by : {BiasBy::kSoftware, BiasBy::kBox}) {
    NetFtBench bench;
    bench.config.bias = by;
    bench.box.set_offset({0.0, 0.0, 2.0}, {});
    ASSERT_FALSE(bench.engage());
    ASSERT_FALSE(bench.sensor->bias());
    bench.box.load({0.0, 0.0, 0.5}, {});
    ASSERT_TRUE(reads(bench, [](const auto& s) { return near(s.sensor_force_n.z, 0.5); }));
    const std::uint32_t serial = bench.read().bias_serial;  // of a record since the bias
    bench.box.bias_by_another();
    EXPECT_TRUE(eventually([&] { return bench.finds("another client has biased the box"); }));
    EXPECT_TRUE(reads(bench, [&](const auto& s) {
      return s.bias_serial == serial + 1 && (s.status & status::kForceWarning) != 0;
    }));
    ASSERT_FALSE(bench.sensor->bias());
    EXPECT_FALSE(bench.finds("another client"));
    EXPECT_TRUE(reads(bench, [](const auto& s) { return s.status == 0 && near(s.sensor_force_n.z, 0.0); }));
  }
}

TEST(NetFtBias, InSoftwareOutlastsARestartOfABoxThatHadNone) {
  NetFtBench bench;
  bench.box.set_offset({0.0, 0.0, 2.0}, {});
  ASSERT_FALSE(bench.engage());
  ASSERT_FALSE(bench.sensor->bias());
  const int pages = bench.box.page().requests();
  bench.box.restart(0.5);
  ASSERT_TRUE(eventually([&] { return bench.figure("box_restarts") == 1.0; }));
  ASSERT_TRUE(eventually([&] { return bench.box.page().requests() > pages; }));
  EXPECT_TRUE(eventually([&] { return !bench.finds("is lost"); }));
  EXPECT_TRUE(reads(bench, [](const auto& s) { return s.status == 0 && near(s.sensor_force_n.z, 0.0); }));
}

TEST(NetFtBias, InSoftwareOutlastsLettingGoOfTheSensor) {
  NetFtBench bench;
  bench.box.set_offset({0.0, 0.0, 2.0}, {});
  ASSERT_FALSE(bench.engage());
  EXPECT_EQ(bench.read().bias_serial, 0U);
  ASSERT_FALSE(bench.sensor->bias());
  ASSERT_TRUE(
      reads(bench, [](const auto& s) { return s.bias_serial == 1 && near(s.sensor_force_n.z, 0.0); }));
  bench.sensor->disengage();
  EXPECT_EQ(bench.read().bias_serial, 1U) << "not engaged, still the same zero";
  ASSERT_FALSE(bench.sensor->engage());
  // From the first sample on.
  EXPECT_TRUE(reads(bench, [](const auto& s) {
    EXPECT_EQ(s.bias_serial, 1U);
    if (s.force_count > 0) {
      EXPECT_TRUE(near(s.sensor_force_n.z, 0.0)) << s.sensor_force_n.z;
    }
    return s.force_count > 0 && s.status == 0;
  }));
  EXPECT_FALSE(bench.finds("is lost"));
  ASSERT_FALSE(bench.sensor->bias());
  EXPECT_TRUE(reads(bench, [](const auto& s) { return s.bias_serial == 2; })) << "every bias counts";
}

TEST(NetFtBias, IsForgottenWhereTheBoxCountsOtherwise) {
  emulators::NetFtBoxSettings settings;
  NetFtBench bench(settings);
  bench.box.set_offset({0.0, 0.0, 2.0}, {});
  ASSERT_FALSE(bench.engage());
  ASSERT_FALSE(bench.sensor->bias());
  bench.sensor->disengage();
  settings.counts_per_force = 2e6;
  bench.box.change_settings(settings);
  bench.box.set_offset({0.0, 0.0, 2.0}, {});
  ASSERT_FALSE(bench.sensor->engage());
  EXPECT_TRUE(reads(bench, [](const auto& s) {
    return s.bias_serial == 2 && (s.status & status::kForceWarning) != 0 && near(s.sensor_force_n.z, 2.0);
  }));
  EXPECT_TRUE(bench.finds("is lost"));
}

TEST(NetFtBias, ABoxThatRestartsWithOtherCountsIsUnfitUntilEngagedAgain) {
  emulators::NetFtBoxSettings settings;
  NetFtBench bench(settings);
  bench.box.load({1.0, 0.0, 0.0}, {});
  ASSERT_FALSE(bench.engage());
  settings.counts_per_force = 2e6;
  bench.box.change_settings(settings);
  bench.box.restart(0.5);
  EXPECT_TRUE(eventually([&] { return bench.finds("other counts or units"); }));
  EXPECT_TRUE(reads(bench, [](const auto& s) { return (s.status & status::kForceFault) != 0; }));
  EXPECT_TRUE(eventually([&] { return bench.sensor->report().state == hal::PartState::kFaulty; }));
  bench.sensor->disengage();
  ASSERT_FALSE(bench.sensor->engage());
  EXPECT_TRUE(reads(bench, [](const auto& s) { return s.status == 0 && near(s.sensor_force_n.x, 1.0); }));
}

}  // namespace
}  // namespace hapticd::netft
