#include "server/process/standard_streams.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include "tests/support/full_pipe.h"

namespace hapticd::server {
namespace {

// A file that is opened later must not get the number of standard error: the log would be written into it.
TEST(StandardStreams, AreOpenInAProcessThatWasStartedWithoutThem) {
  testing::FLAGS_gtest_death_test_style = "threadsafe";
  for (const int missing : {1, 3, 5, 7}) {  // one bit for each
    EXPECT_EXIT(
        {
          for (const int stream : {0, 1, 2}) {
            if ((missing >> stream & 1) != 0) close(stream);
          }
          open_standard_streams();
          _exit(open("/dev/null", O_RDONLY) > STDERR_FILENO ? 0 : 1);
        },
        testing::ExitedWithCode(0), "");
  }
}

TEST(StandardStreams, GetNoLineWhileTheirReaderStandsStill) {
  const test::FullPipe pipe;
  write_if_ready(pipe.in(), "x\n");  // returns
  EXPECT_GT(pipe.read_all(), 0U);
  write_if_ready(pipe.in(), "x\n");
  EXPECT_EQ(pipe.read_all(), 2U);
}

}  // namespace
}  // namespace hapticd::server
