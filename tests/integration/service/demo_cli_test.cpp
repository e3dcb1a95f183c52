// hapticctl demo: what the first command of the README runs.

#include <gtest/gtest.h>

#include <filesystem>

#include "tests/integration/running_service.h"
#include "tests/support/child_process.h"
#include "tests/support/temporary_folder.h"

namespace hapticd::test {
namespace {

ChildProcess demo(const RunningService& service, const std::string& folder) {
  return ChildProcess(HAPTICCTL_BINARY, {"--server", service.address(), "demo", "--targets", "0.3", "--force",
                                         "2", "--hold", "1", "--out", folder});
}

TEST(HapticctlDemo, MakesTheFolderOfItsResults) {
  const RunningService service;
  const TemporaryFolder folder;
  const std::string results = folder.path() + "/out/demo";
  ChildProcess run = demo(service, results);
  ASSERT_EQ(run.wait(), 0) << run.errors() << run.output();
  for (const char* name : {"recording.csv", "stiffness.svg", "results.json"})
    EXPECT_GT(std::filesystem::file_size(results + "/" + name), 0U) << name;
}

TEST(HapticctlDemo, NamesAFolderThatCannotBeMade) {
  const RunningService service;
  ChildProcess run = demo(service, "/dev/null/demo");
  EXPECT_EQ(run.wait(), 2);
  EXPECT_NE(run.errors().find("/dev/null/demo"), std::string::npos) << run.errors();
}

}  // namespace
}  // namespace hapticd::test
