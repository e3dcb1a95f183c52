#include <gtest/gtest.h>

#include "server/config/config.h"
#include "tests/support/refusals.h"
#include "tests/support/value_of.h"

namespace hapticd::server {
namespace {

TEST(WatchdogSection, ReadsBackWhatItWrites) {
  DaemonConfig config;
  EXPECT_TRUE(parse_config(write_config(config), "none")->watchdog.endpoints.empty());
  config.watchdog.endpoints = {{"pedal", 250.0, true}, {"experiment", 1000.5, false}};
  const auto read = test::value_of(parse_config(write_config(config), "two"));
  ASSERT_EQ(read.watchdog.endpoints.size(), 2U);
  EXPECT_EQ(read.watchdog.endpoints[0].name, "pedal");
  EXPECT_EQ(read.watchdog.endpoints[0].timeout_ms, 250.0);
  EXPECT_TRUE(read.watchdog.endpoints[0].pedal);
  EXPECT_EQ(read.watchdog.endpoints[1].timeout_ms, 1000.5);
}

TEST(WatchdogSection, RefusesWhatCannotBe) {
  using enum hal::ErrorCode;
  const std::string begin = "[[watchdog.endpoint]]\n";
  std::vector<test::RefusedText> texts{
      {begin + "name = \"a b\"\n", "name", kMalformed, 2},
      {begin + "timeout_ms = 100\n", "name", kMissingKey, 1},
      {begin + "name = \"a\"\n" + begin + "name = \"a\"\n", "name", kContradiction, 4},
      {begin + "name = \"a\"\ntimeout = 3\n", "'timeout'", kUnknownKey, 3},
      {begin + "name = \"a\"\ntimeout_ms = \"500\"\n", "timeout_ms", kWrongType, 3},
  };
  for (const char* timeout : {"0", "-1", "49.9", "60001", "1e300", "nan", "inf"}) {
    const bool is_number = timeout[0] != 'n' && timeout[0] != 'i';
    texts.push_back({begin + "name = \"a\"\ntimeout_ms = " + timeout + "\n", "timeout_ms",
                     is_number ? kOutOfRange : kNotFinite, 3});
  }
  std::string many;
  for (int i = 0; i < 17; ++i) many += begin + "name = \"a" + std::to_string(i) + "\"\n";
  texts.push_back({many, "watchdog.endpoint", kOutOfRange, 1});
  test::expect_refusals(texts, [](const std::string& text) { return parse_config(text, "test.toml"); });
}

}  // namespace
}  // namespace hapticd::server
