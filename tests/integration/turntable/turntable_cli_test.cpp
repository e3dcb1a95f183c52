#include <gtest/gtest.h>
#include <signal.h>

#include <nlohmann/json.hpp>
#include <sstream>

#include "client/cli/session/exit_code.h"
#include "tests/integration/running_service.h"
#include "tests/support/child_process.h"
#include "tests/support/eventually.h"

namespace hapticd::test {
namespace {

using Json = nlohmann::json;

server::DaemonConfig homed_table() {
  server::DaemonConfig config =
      config_with_table({{"sponge", 0.0, "sponge_block"}, {"rubber", 40.0, "rubber_ball"}});
  config.turntable.sim.homed = true;
  return config;
}

class HapticctlTurntable : public testing::Test {
 protected:
  std::vector<std::string> line(std::vector<std::string> words) const {
    words.insert(words.begin(), {"--server", service.address(), "turntable"});
    return words;
  }
  Ran run(const std::vector<std::string>& words) const {
    return run_to_the_end(HAPTICCTL_BINARY, line(words));
  }
  RunningService service{homed_table()};
};

TEST_F(HapticctlTurntable, ShowsTurnsAndShowsAgain) {
  Ran ran = run({"status"});
  EXPECT_EQ(ran.code, 0) << ran.errors;
  EXPECT_NE(ran.output.find("idle: its port is not open"), std::string::npos) << ran.output;
  ran = run({"home"});
  EXPECT_EQ(ran.code, 0) << ran.errors;
  EXPECT_EQ(ran.output, "standing at 0.00 deg, station 'sponge'\n");
  ran = run({"goto", "rubber", "--speed", "60"});
  EXPECT_EQ(ran.code, 0) << ran.errors;
  EXPECT_EQ(ran.output, "standing at 40.00 deg, station 'rubber'\n");
  ran = run({"move", "-10"});
  EXPECT_EQ(ran.code, 0) << ran.errors;
  EXPECT_EQ(ran.output, "standing at -10.00 deg\n");
  ran = run({"stations", "--json"});
  const Json stations = Json::parse(ran.output);
  EXPECT_EQ(stations["stations"][1]["name"], "rubber");
  EXPECT_EQ(stations["stations"][1]["angle_deg"], 40.0);
  ran = run({"disengage"});
  EXPECT_EQ(ran.output, "idle: its port is not open\n");
}

TEST_F(HapticctlTurntable, SpeaksJsonLineByLine) {
  const Ran ran = run({"--json", "goto", "rubber"});
  EXPECT_EQ(ran.code, 0) << ran.errors;
  std::istringstream lines(ran.output);
  Json last;
  for (std::string text; std::getline(lines, text);) last = Json::parse(text);
  EXPECT_EQ(last["state"], "standing");
  EXPECT_EQ(last["station"], "rubber");
  EXPECT_EQ(last["motion"]["end"], "arrived");
  const Json error = Json::parse(run({"--json", "goto", "nowhere"}).output)["error"];
  EXPECT_EQ(error["kind"], "refused");
  EXPECT_EQ(error["reason"], "not_found") << error.dump();
  const Json status = Json::parse(run({"status", "--json"}).output);
  EXPECT_EQ(status["name"], "sim:turntable");
  EXPECT_EQ(status["status"]["station"], "rubber");
}

TEST_F(HapticctlTurntable, ARefusalIsReportedWithItsRemedy) {
  const Ran ran = run({"goto", "ruber"});
  EXPECT_EQ(ran.code, static_cast<int>(cli::ExitCode::kRefused));
  EXPECT_NE(ran.errors.find("did you mean 'rubber'?"), std::string::npos) << ran.errors;
  EXPECT_EQ(run({"goto"}).code, static_cast<int>(cli::ExitCode::kUsage));
  EXPECT_EQ(run({"move", "10", "--speed", "0"}).code, static_cast<int>(cli::ExitCode::kUsage));
}

TEST_F(HapticctlTurntable, CtrlCStopsTheTable) {
  ChildProcess child(HAPTICCTL_BINARY, line({"--json", "move", "170", "--speed", "10"}));
  while (Json::parse(child.read_line())["motion"]["completion"] < 0.001) {
  }
  child.signal(SIGINT);
  EXPECT_EQ(child.wait(), static_cast<int>(cli::ExitCode::kNotConverged)) << child.errors();
  const Json status = Json::parse(run({"status", "--json"}).output);
  EXPECT_EQ(status["status"]["state"], "standing");
  EXPECT_EQ(status["status"]["motion"]["end"], "stopped");
}

TEST_F(HapticctlTurntable, AKilledClientStopsTheTable) {
  {
    ChildProcess child(HAPTICCTL_BINARY, line({"--json", "move", "170", "--speed", "10"}));
    while (Json::parse(child.read_line())["motion"]["completion"] < 0.001) {
    }
  }
  Json status;
  EXPECT_TRUE(eventually([&] {
    status = Json::parse(run({"status", "--json"}).output)["status"];
    return status["state"] == "standing";
  }));
  EXPECT_EQ(status["motion"]["end"], "stopped");
}

}  // namespace
}  // namespace hapticd::test
