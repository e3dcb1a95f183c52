// hapticctl feasible, typed at any moment of a hand that presses again and again.

#include <gtest/gtest.h>

#include "client/cli/session/exit_code.h"
#include "tests/integration/running_service.h"
#include "tests/support/child_process.h"

namespace hapticd::test {
namespace {

int feasible(const RunningService& service, const std::string& wait_s, std::string* errors = nullptr) {
  ChildProcess child(HAPTICCTL_BINARY, {"--server", service.address(), "feasible", "--wait", wait_s});
  const int code = child.wait();
  if (errors != nullptr) *errors = child.errors();
  return code;
}

TEST(HapticctlFeasible, WaitsForTheNextContact) {
  const RunningService service(config_with_scene("tap_1d"));
  service.set_hand(v1::HAND_PROGRAM_KIND_PRESS, [](v1::HandProgram& press) {
    press.set_force_n(2.0);
    press.set_hold_s(30.0);
  });
  std::string errors;
  EXPECT_EQ(feasible(service, "60", &errors), 0) << errors;
}

TEST(HapticctlFeasible, WithoutOneSaysWhatIsMissing) {
  const RunningService service(config_with_scene("tap_1d"));
  std::string errors;
  EXPECT_EQ(feasible(service, "0.2", &errors), static_cast<int>(cli::ExitCode::kRefused));
  EXPECT_NE(errors.find("not in contact"), std::string::npos) << errors;
}

TEST(HapticctlFeasible, WaitsForNothingElse) {
  const RunningService service;  // no scene: no contact would help
  std::string errors;
  const auto began = std::chrono::steady_clock::now();
  EXPECT_EQ(feasible(service, "60", &errors), static_cast<int>(cli::ExitCode::kRefused));
  EXPECT_LT(std::chrono::steady_clock::now() - began, std::chrono::seconds(30)) << errors;
}

TEST(HapticctlFeasible, SaysThatNothingIsAndWhy) {
  const RunningService service(config_with_scene("tap_1d"));
  ChildProcess child(HAPTICCTL_BINARY, {"--server", service.address(), "feasible", "--hand-force", "4",
                                        "--object-stiffness", "380"});
  EXPECT_EQ(child.wait(), 0) << child.errors();
  EXPECT_NE(child.output().find("nothing: the device makes this object no softer than"), std::string::npos)
      << child.output();
}

}  // namespace
}  // namespace hapticd::test
