#include "server/process/end_limit.h"

#include <gtest/gtest.h>
#include <signal.h>
#include <unistd.h>

#include "server/process/ending_signals.h"
#include "tests/support/full_pipe.h"

namespace hapticd::server {
namespace {

// The process holds back all signals that end it, and gRPC waits: so is the daemon once SIGTERM has come.
TEST(EndLimit, EndsAProcessThatDoesNot) {
  testing::FLAGS_gtest_death_test_style = "threadsafe";
  EXPECT_EXIT(
      {
        hold_back_ending_signals();
        end_within(std::chrono::milliseconds(20));
        for (;;) pause();
      },
      testing::ExitedWithCode(0), "did not end in time");
}

// Its last words must not be what keeps it.
TEST(EndLimit, EndsAProcessWhoseErrorsAreNotRead) {
  testing::FLAGS_gtest_death_test_style = "threadsafe";
  EXPECT_EXIT(
      {
        const test::FullPipe pipe;
        dup2(pipe.in(), STDERR_FILENO);
        end_within(std::chrono::milliseconds(20));
        for (;;) pause();
      },
      testing::ExitedWithCode(0), "");
}

}  // namespace
}  // namespace hapticd::server
