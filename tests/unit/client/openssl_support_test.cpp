#include "client/cpp/tls/openssl_support.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <cerrno>

namespace hapticd::client {
namespace {

bool is_blocked() {
  sigset_t now{};
  pthread_sigmask(SIG_SETMASK, nullptr, &now);
  return sigismember(&now, SIGPIPE) == 1;
}

TEST(NoPipeSignal, WritingToWhatIsClosedIsAnErrorAndLeavesNoSignalBehind) {
  int ends[2];
  ASSERT_EQ(pipe(ends), 0);
  close(ends[0]);
  ASSERT_FALSE(is_blocked());
  {
    const NoPipeSignal held;
    EXPECT_EQ(write(ends[1], "x", 1), -1);
    EXPECT_EQ(errno, EPIPE);
    EXPECT_TRUE(is_blocked());
  }
  EXPECT_FALSE(is_blocked());
  sigset_t pending{};
  sigpending(&pending);
  EXPECT_EQ(sigismember(&pending, SIGPIPE), 0);
  close(ends[1]);
}

}  // namespace
}  // namespace hapticd::client
