// hapticctl scene, next to files of scenes.

#include <gtest/gtest.h>

#include "client/cli/session/exit_code.h"
#include "tests/integration/running_service.h"
#include "tests/support/child_process.h"
#include "tests/support/temporary_folder.h"

namespace hapticd::test {
namespace {

TEST(HapticctlScene, ANameThatIsAFileHereIsToldTheFile) {
  const RunningService service;
  const TemporaryFolder folder;
  folder.write("my_sponge.toml", "name = \"my_sponge\"\n");
  const auto run = [&](const std::string& words) {
    ChildProcess child("/bin/sh", {"-c", "cd " + folder.path("") + " && " + HAPTICCTL_BINARY + " --server " +
                                             service.address() + " scene " + words});
    EXPECT_EQ(child.wait(), static_cast<int>(cli::ExitCode::kRefused)) << child.errors();
    return child.errors();
  };
  for (const char* command : {"load ", "explain ", "show "}) {
    const std::string errors = run(command + std::string("my_sponge"));
    EXPECT_NE(errors.find("did you mean the file './my_sponge.toml'?"), std::string::npos) << errors;
  }
  const std::string other = run("load tap_1e");
  EXPECT_NE(other.find("tap_1d"), std::string::npos) << other;
  EXPECT_EQ(other.find("the file"), std::string::npos) << other;
}

}  // namespace
}  // namespace hapticd::test
