#include <gtest/gtest.h>

#include "server/config/config.h"

namespace hapticd::server {
namespace {

std::string problem_of(const std::string& text) {
  const auto config = parse_config(text, "test.toml");
  return config ? "" : config.error().text();
}

TEST(WatchdogSection, ReadsBackWhatItWrites) {
  DaemonConfig config;
  EXPECT_TRUE(parse_config(write_config(config), "none")->watchdog.endpoints.empty());
  config.watchdog.endpoints = {{"pedal", 250.0, true}, {"experiment", 1000.5, false}};
  const auto read = parse_config(write_config(config), "two");
  ASSERT_TRUE(read) << read.error().text();
  ASSERT_EQ(read->watchdog.endpoints.size(), 2U);
  EXPECT_EQ(read->watchdog.endpoints[0].name, "pedal");
  EXPECT_EQ(read->watchdog.endpoints[0].timeout_ms, 250.0);
  EXPECT_TRUE(read->watchdog.endpoints[0].pedal);
  EXPECT_EQ(read->watchdog.endpoints[1].timeout_ms, 1000.5);
}

TEST(WatchdogSection, RefusesWhatCannotBe) {
  const std::string begin = "[[watchdog.endpoint]]\n";
  EXPECT_NE(problem_of(begin + "name = \"a b\"\n").find("not a name"), std::string::npos);
  EXPECT_NE(problem_of(begin + "timeout_ms = 100\n").find("no name"), std::string::npos);
  for (const char* timeout : {"0", "-1", "49.9", "60001", "nan", "inf", "1e300", "\"500\""}) {
    EXPECT_NE(problem_of(begin + "name = \"a\"\ntimeout_ms = " + timeout + "\n"), "") << timeout;
  }
  EXPECT_NE(problem_of(begin + "name = \"a\"\n" + begin + "name = \"a\"\n").find("one name"),
            std::string::npos);
  EXPECT_NE(problem_of(begin + "name = \"a\"\ntimeout = 3\n").find("timeout"), std::string::npos);
  std::string many;
  for (int i = 0; i < 17; ++i) many += begin + "name = \"a" + std::to_string(i) + "\"\n";
  EXPECT_NE(problem_of(many), "");
}

}  // namespace
}  // namespace hapticd::server
