// How a connection is made, refused and ended.

#include <dirent.h>
#include <gtest/gtest.h>

#include <functional>

#include "netft_bench.h"

namespace hapticd::netft {
namespace {

using emulators::PageManner;

constexpr std::uint16_t kStop = 0x00;
constexpr std::uint16_t kStart = 0x02;

int open_descriptors() {
  int count = 0;
  DIR* folder = opendir("/proc/self/fd");
  while (readdir(folder) != nullptr) ++count;
  closedir(folder);
  return count;
}

/// Refused with an error that has these words, and nothing left open.
void expect_refusal(NetFtBench& bench, const std::string& what, const std::string& where) {
  const auto error = bench.engage();
  ASSERT_TRUE(error);
  EXPECT_NE(error->what.find(what), std::string::npos) << error->text();
  EXPECT_NE(error->where.find(where), std::string::npos) << error->text();
  EXPECT_FALSE(error->remedy.empty());
  EXPECT_EQ(bench.sensor->report().state, hal::PartState::kFaulty);
  EXPECT_TRUE(bench.finds(what));
  EXPECT_EQ(bench.read().status, hal::sample_status::kForceMissing);
}

TEST(NetFtEngage, DeliversAndSaysHow) {
  NetFtBench bench;
  const auto error = bench.engage();
  ASSERT_FALSE(error) << error->text();
  const hal::PartReport report = bench.sensor->report();
  EXPECT_EQ(report.part, "force sensor");
  EXPECT_EQ(report.driver, "netft");
  EXPECT_EQ(report.state, hal::PartState::kReady);
  EXPECT_EQ(report.connection, "udp 127.0.0.1:" + std::to_string(bench.box.udp_port()) + ", 7000 Hz");
  EXPECT_EQ(bench.box.page().requests(), 1);
  EXPECT_EQ(bench.box.invalid_requests(), 0);
  // Engaged already: nothing happens.
  const int requests = bench.box.commands(kStart);
  EXPECT_FALSE(bench.sensor->engage());
  EXPECT_EQ(bench.box.commands(kStart), requests);
}

TEST(NetFtEngage, DisengagingSaysTheBoxAndClosesAll) {
  NetFtBench bench;
  auto made = NetFtSensor::create(bench.config);
  ASSERT_TRUE(made);
  bench.sensor = std::move(*made);
  for (int round = 0; round < 3; ++round) {
    const int before = open_descriptors();
    ASSERT_FALSE(bench.sensor->engage());
    EXPECT_GT(open_descriptors(), before);
    EXPECT_EQ(bench.read().force_age_ns < 10'000'000'000, true);
    bench.sensor->disengage();
    EXPECT_TRUE(eventually([&] { return bench.box.commands(kStop) == round + 1; }));
    EXPECT_TRUE(eventually([&] { return open_descriptors() == before; }));
    EXPECT_FALSE(bench.box.streaming());
    EXPECT_EQ(bench.sensor->report().state, hal::PartState::kIdle);
    EXPECT_TRUE(bench.sensor->report().findings.empty());
  }
  bench.sensor->disengage();  // twice is no more than once
}

TEST(NetFtEngage, AHostNameWillDo) {
  NetFtBench bench;
  bench.config.address = "localhost";
  const auto error = bench.engage();
  EXPECT_FALSE(error) << error->text();
}

TEST(NetFtEngage, ALostRequestIsRepeated) {
  NetFtBench bench;
  bench.box.set_deaf(true);
  std::thread later([&] {
    EXPECT_TRUE(eventually([&] { return bench.box.commands_unheard() > 0; }));
    bench.box.set_deaf(false);
  });
  const auto error = bench.engage();
  later.join();
  ASSERT_FALSE(error) << error->text();
  EXPECT_GE(bench.figure("stream_requests"), 2.0);
}

TEST(NetFtEngage, RefusesWhatCannotBeReadByName) {
  using Settings = emulators::NetFtBoxSettings;
  const auto set = [](auto Settings::*member, auto value) {
    Settings settings;
    settings.*member = value;
    return settings;
  };
  const auto nothing = [](NetFtBench&) {};
  const auto manner = [](PageManner how) {
    return [how](NetFtBench& bench) { bench.box.page().set_manner(how); };
  };
  const auto text = [](const char* shown) {
    return [shown](NetFtBench& bench) { bench.box.page().set_text(shown); };
  };
  // A server that hangs or drips is not waited for.
  const auto hurried = [](PageManner how) {
    return [how](NetFtBench& bench) {
      bench.config.connect_timeout_s = 0.3;
      bench.box.page().set_manner(how);
    };
  };
  struct Case {
    Settings settings;
    std::function<void(NetFtBench&)> spoil;
    const char* what;
    const char* where;
  };
  const char* page = "/netftapi2.xml";
  for (const Case& one : {
           Case{set(&Settings::has_page, false), nothing, "does not answer over HTTP", page},
           Case{{}, manner(PageManner::kNotFound), "no such page", page},
           Case{{}, manner(PageManner::kRefuse), "does not answer over HTTP", page},
           Case{{}, hurried(PageManner::kHang), "did not answer over HTTP in time", page},
           Case{{}, hurried(PageManner::kDrip), "did not answer over HTTP in time", page},
           Case{{}, manner(PageManner::kEndless), "too long", page},
           Case{{}, text("<html><body>It works!</body></html>"), "missing", "cfgcpf"},
           Case{{}, text("<netft><cfgcpf>1000000</cfgcpf"), "not XML", page},
           Case{set(&Settings::force_unit, "stone"), nothing, "unknown unit of force", "scfgfu"},
           Case{{},
                [](NetFtBench& bench) { bench.config.model = "nano17_si_12"; },
                "calibration of the box is not that of a SI-12-0.12",
                "cfgmr"},
           Case{{},
                [](NetFtBench& bench) { bench.config.serial = "FT99999"; },
                "the active calibration of the box is not the expected one",
                "cfgcalsn"},
           Case{set(&Settings::rdt_enabled, false), nothing, "switched off", "comrdte"},
           Case{set(&Settings::rate_hz, 500.0), nothing, "too slowly", "comrdtrate"},
       }) {
    SCOPED_TRACE(one.what);
    NetFtBench bench(one.settings);
    one.spoil(bench);
    expect_refusal(bench, one.what, one.where);
  }
}

TEST(NetFtEngage, TakesAnImperialCalibrationForItsMetricTwin) {
  emulators::NetFtBoxSettings settings;  // US-6-2
  settings.force_range_n = {6 * 4.448, 6 * 4.448, 8.5 * 4.448};
  settings.torque_range_n_mm = 2 * 112.98;
  settings.force_unit = "lbf";
  settings.torque_unit = "lbf-in";
  NetFtBench bench(settings);
  const auto error = bench.engage();
  EXPECT_FALSE(error) << error->text();
}

TEST(NetFtEngage, RefusesABoxThatSendsNothing) {
  NetFtBench bench;
  bench.config.connect_timeout_s = 0.5;
  bench.box.set_silent(true);
  expect_refusal(bench, "no sample came", "udp port");
  EXPECT_TRUE(eventually([&] { return bench.box.commands(kStop) == 1; }));
}

TEST(NetFtEngage, RefusesABoxThatSendsOnlyGarbage) {
  NetFtBench bench;
  bench.config.connect_timeout_s = 0.5;
  bench.box.set_silent(true);
  std::atomic<bool> over{false};
  std::thread spoiler([&] {
    while (!over.load()) {
      bench.box.send_garbage(1);
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
    }
  });
  const auto error = bench.engage();
  over.store(true);
  spoiler.join();
  ASSERT_TRUE(error);
  EXPECT_NE(error->value.find("not RDT records"), std::string::npos) << error->text();
}

TEST(NetFtEngage, RefusesABoxThatReportsItselfUnfitByWhatItReports) {
  NetFtBench bench;
  bench.config.connect_timeout_s = 0.5;
  bench.box.set_status(0x8000'0010U);
  expect_refusal(bench, "reports a fault", "Net F/T box");
  EXPECT_TRUE(bench.finds("no data on the link to the transducer"));
}

TEST(NetFtEngage, AfterARefusalItMayBeTriedAgain) {
  NetFtBench bench;
  bench.box.page().set_manner(PageManner::kNotFound);
  ASSERT_TRUE(bench.engage());
  bench.box.page().set_manner(PageManner::kServe);
  EXPECT_FALSE(bench.sensor->engage());
  EXPECT_EQ(bench.sensor->report().state, hal::PartState::kReady);
}

TEST(NetFtEngage, SettingsThatCouldBeBetterAreFindingsWithARemedy) {
  emulators::NetFtBoxSettings settings{.rate_hz = 2000.0, .user_filter = 4};
  settings.tool_transformation = "0;0;132.71;0;0;0";
  NetFtBench bench(settings);
  ASSERT_FALSE(bench.engage());
  EXPECT_TRUE(bench.finds("set to 2000 Hz, expected are 7000 Hz: set the RDT output rate"));
  EXPECT_TRUE(bench.finds("low-pass filter of 73 Hz, which delays the force by about 2.18 ms"));
  EXPECT_TRUE(bench.finds("tool transformation"));
  EXPECT_EQ(bench.figure("low_pass"), 73.0);
  EXPECT_EQ(bench.figure("rate_set"), 2000.0);
}

TEST(NetFtEngage, AnotherFilterThanExpectedIsAFinding) {
  NetFtBench bench({.user_filter = 9});
  bench.config.low_pass_hz = 0.0;
  ASSERT_FALSE(bench.engage());
  EXPECT_TRUE(bench.finds("low-pass filter of 1500 Hz, expected is none"));
}

}  // namespace
}  // namespace hapticd::netft
