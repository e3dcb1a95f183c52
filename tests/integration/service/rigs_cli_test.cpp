// hapticctl --rigs: several daemons at once, one of which may be missing.

#include <gtest/gtest.h>

#include <cstdlib>
#include <fstream>
#include <nlohmann/json.hpp>

#include "tests/integration/running_service.h"
#include "tests/support/child_process.h"
#include "tests/support/temporary_folder.h"

namespace hapticd::test {
namespace {

TEST(HapticctlRigs, StopReachesEachRigThatIsThereAndTheOthersAreNamed) {
  const RunningService left;
  const RunningService right;
  const TemporaryFolder folder;
  const std::string file = folder.path() + "/rigs.toml";
  std::ofstream(file) << "[left]\nserver = \"" << left.address()
                      << "\"\n[gone]\nserver = \"unix:" << folder.path()
                      << "/none.sock\"\n[right]\nserver = \"" << right.address() << "\"\n";
  setenv("HAPTICD_RIGS", file.c_str(), 1);

  ChildProcess stop(HAPTICCTL_BINARY, {"--json", "--rigs", "right,gone,left", "stop"});
  EXPECT_EQ(stop.wait(), 3) << "the worst of all: one is not reached";
  const auto answers = nlohmann::json::parse(stop.output());
  EXPECT_EQ(answers.at("right").at("guard_state"), "latched") << stop.output();
  EXPECT_EQ(answers.at("left").at("guard_state"), "latched");
  EXPECT_EQ(answers.at("gone").at("error").at("kind"), "unreachable");
  for (const RunningService* rig : {&left, &right}) {
    rig->await([](const v1::RigState& s) { return s.guard_state() == v1::GUARD_STATE_LATCHED; });
  }

  ChildProcess status(HAPTICCTL_BINARY, {"--rigs", "left,right", "status"});
  EXPECT_EQ(status.wait(), 0);
  EXPECT_LT(status.output().find("left ("), status.output().find("right (")) << status.output();
  unsetenv("HAPTICD_RIGS");
}

TEST(HapticctlRigs, AStopThatCannotBeStartedForOneRigHoldsUpNoOther) {
  const RunningService first;
  const TemporaryFolder folder;
  const std::string file = folder.path() + "/rigs.toml";
  std::ofstream list(file);
  list << "[first]\nserver = \"" << first.address() << "\"\n";
  std::string names = "first";
  for (int i = 0; i < 100; ++i) {  // more than there are descriptors for
    list << "[rig" << i << "]\nserver = \"unix:" << folder.path() << "/none.sock\"\n";
    names += ",rig" + std::to_string(i);
  }
  list.close();
  setenv("HAPTICD_RIGS", file.c_str(), 1);
  ChildProcess stop("/bin/bash", {"-c", "ulimit -n 64; exec \"$@\"", "bash", HAPTICCTL_BINARY, "--json",
                                  "--rigs", names, "stop"});
  EXPECT_EQ(stop.wait(), 3);
  unsetenv("HAPTICD_RIGS");
  const auto answers = nlohmann::json::parse(stop.output());
  EXPECT_EQ(answers.at("first").at("guard_state"), "latched") << stop.output();
  EXPECT_EQ(answers.at("rig99").at("error").at("kind"), "error");
}

}  // namespace
}  // namespace hapticd::test
