#include <gtest/gtest.h>
#include <signal.h>

#include "tests/support/child_process.h"

namespace hapticd::test {
namespace {

Ran crash(const char* way) {
  return run_to_the_end(CRASH_VICTIM, {way});
}

TEST(CrashGuard, WritesZeroOnceAndEndsByTheSignal) {
  const std::pair<const char*, int> ways[] = {
      {"segv", SIGSEGV},  {"bus", SIGBUS},        {"fpe", SIGFPE},     {"ill", SIGILL},
      {"abort", SIGABRT}, {"terminate", SIGABRT}, {"killed", SIGSEGV}, {"crash_in_thread", SIGSEGV},
      {"unread", SIGABRT}};
  for (const auto& [way, signal] : ways) {
    const Ran end = crash(way);
    EXPECT_EQ(end.code, -signal) << way;
    EXPECT_EQ(end.output, "zero\n") << way;
  }
}

TEST(CrashGuard, WorksWhereTheStackIsUsedUp) {
  for (const char* way : {"overflow", "overflow_in_thread"}) {
    const Ran end = crash(way);
    EXPECT_EQ(end.code, -SIGSEGV) << way;
    EXPECT_EQ(end.output, "zero\n") << way;
  }
}

TEST(CrashGuard, EndsAlsoWhereTheDriverCrashesItself) {
  const Ran end = crash("crash_in_driver");
  EXPECT_EQ(end.code, -SIGABRT);
  EXPECT_EQ(end.output, "zero\n") << "once";
}

TEST(CrashGuard, LeavesARigAloneThatWasTakenBack) {
  const Ran end = crash("none");
  EXPECT_EQ(end.code, -SIGABRT);
  EXPECT_EQ(end.output, "");
}

}  // namespace
}  // namespace hapticd::test
