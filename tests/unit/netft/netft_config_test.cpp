#include "hal/netft/netft_config.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>

#include "hal/netft/netft_sensor.h"
#include "hal/netft/netft_units.h"

namespace hapticd::netft {
namespace {

TEST(NetFtConfig, DefaultsAreSound) {
  EXPECT_FALSE(check(NetFtConfig{}));
}

TEST(NetFtConfig, EveryWrongValueIsRefusedByItsKey) {
  struct Case {
    const char* key;
    std::function<void(NetFtConfig&)> spoil;
  };
  const double nan = std::nan("");
  const Case cases[] = {
      {"address", [](NetFtConfig& c) { c.address = ""; }},
      {"address", [](NetFtConfig& c) { c.address = "10.0.0.1/x"; }},
      {"address", [](NetFtConfig& c) { c.address = "a\r\nb"; }},
      {"rdt_port", [](NetFtConfig& c) { c.rdt_port = 0; }},
      {"rdt_port", [](NetFtConfig& c) { c.rdt_port = 65536; }},
      {"http_port", [](NetFtConfig& c) { c.http_port = -1; }},
      {"http_path", [](NetFtConfig& c) { c.http_path = "netftapi2.xml"; }},
      {"http_path", [](NetFtConfig& c) { c.http_path = "/a b"; }},
      {"rate_hz", [](NetFtConfig& c) { c.rate_hz = 0.0; }},
      {"rate_hz", [=](NetFtConfig& c) { c.rate_hz = nan; }},
      {"lowest_rate_hz", [](NetFtConfig& c) { c.lowest_rate_hz = 8000.0; }},
      {"connect_timeout_s", [](NetFtConfig& c) { c.connect_timeout_s = 0.0; }},
      {"stale_after_ms", [](NetFtConfig& c) { c.stale_after_ms = 0.5; }},
      {"retry_first_ms", [](NetFtConfig& c) { c.retry_first_ms = 3000.0; }},
      {"retry_longest_ms", [](NetFtConfig& c) { c.retry_longest_ms = 1e9; }},
      {"tool_mass_g", [](NetFtConfig& c) { c.tool_mass_g = -1.0; }},
      {"counts_per_force", [](NetFtConfig& c) { c.counts_per_force = 0.0; }},
      {"counts_per_torque", [](NetFtConfig& c) { c.counts_per_torque = -1.0; }},
      {"force_unit", [](NetFtConfig& c) { c.force_unit = "stone"; }},
      {"torque_unit", [](NetFtConfig& c) { c.torque_unit = "N"; }},
      {"low_pass_hz", [](NetFtConfig& c) { c.low_pass_hz = 100.0; }},
      {"model", [](NetFtConfig& c) { c.model = "gamma"; }},
      {"axes", [](NetFtConfig& c) { c.axes = "+x +y -z"; }},
      {"fifo_priority", [](NetFtConfig& c) { c.fifo_priority = 100; }},
  };
  for (const Case& one : cases) {
    NetFtConfig config;
    one.spoil(config);
    const auto error = check(config);
    ASSERT_TRUE(error) << one.key;
    EXPECT_EQ(error->where, std::string("[rig.netft] ") + one.key);
    EXPECT_NE(error->code, hal::ErrorCode::kOther) << one.key;
    EXPECT_FALSE(error->limit.empty());
    EXPECT_FALSE(error->remedy.empty());
    EXPECT_FALSE(NetFtSensor::create(config));
  }
}

TEST(NetFtUnits, AreThoseOfTheBox) {
  struct Case {
    const char* unit;
    double factor;
  };
  for (const Case& c : {Case{"N", 1.0}, Case{"kN", 1000.0}, Case{"lbf", 4.4482216152605},
                        Case{"klbf", 4448.2216152605}, Case{"kgf", 9.80665}, Case{"gf", 0.00980665}}) {
    const auto factor = newtons_per(c.unit, "here");
    ASSERT_TRUE(factor) << c.unit;
    EXPECT_DOUBLE_EQ(*factor, c.factor) << c.unit;
  }
  for (const Case& c :
       {Case{"Nm", 1000.0}, Case{"N-m", 1000.0}, Case{"N·m", 1000.0}, Case{"Nmm", 1.0}, Case{"N-mm", 1.0},
        Case{"kNm", 1e6}, Case{"kN-m", 1e6}, Case{"lbf-in", 112.9848290276167},
        Case{"lbf-ft", 1355.8179483314}, Case{"kgf-cm", 98.0665}, Case{"kg-cm", 98.0665}}) {
    const auto factor = newton_millimetres_per(c.unit, "here");
    ASSERT_TRUE(factor) << c.unit;
    EXPECT_NEAR(*factor, c.factor, 1e-9 * c.factor) << c.unit;
  }
}

TEST(NetFtUnits, RefusesOthersByName) {
  for (const char* unit : {"", "newtons", "Nm", "m", "lb"}) {
    const auto factor = newtons_per(unit, "page, element 'scfgfu'");
    ASSERT_FALSE(factor) << unit;
    EXPECT_EQ(factor.error().where, "page, element 'scfgfu'");
    EXPECT_EQ(factor.error().limit, "N, kN, lbf, klbf, kgf, gf");
  }
  EXPECT_FALSE(newton_millimetres_per("N", "here"));
}

TEST(NetFtSensor, KnowsItselfWithoutAConnection) {
  NetFtConfig config;
  config.model = "nano17_si_50";
  config.tool_mass_g = 12.5;
  const auto sensor = NetFtSensor::create(config);
  ASSERT_TRUE(sensor);
  const hal::SensorInfo& info = (*sensor)->info();
  EXPECT_EQ(info.model, "nano17_si_50");
  EXPECT_EQ(info.range_n, 70.0);
  EXPECT_EQ(info.resolution_n, 1.0 / 80.0);
  EXPECT_EQ(info.sample_rate_hz, 7000.0);
  EXPECT_EQ(info.tool_mass_g, 12.5);
  EXPECT_EQ((*sensor)->report().state, hal::PartState::kIdle);
}

}  // namespace
}  // namespace hapticd::netft
