#include "server/process/end_limit.h"

#include <pthread.h>
#include <signal.h>
#include <sys/syscall.h>
#include <sys/time.h>
#include <unistd.h>

#include <string_view>

#include "server/process/standard_streams.h"

namespace hapticd::server {

namespace {

/// Async-signal-safe.
void end_now(int /*number*/) {
  constexpr std::string_view kWords =
      "hapticd: calls or computations did not end in time; it ends without them\n";
  write_if_ready(STDERR_FILENO, kWords);
  syscall(SYS_exit_group, 0);  // not by _exit(): a sanitizer's writes and waits first
}

}  // namespace

void end_within(std::chrono::milliseconds limit) {
  struct sigaction ends {};
  ends.sa_handler = end_now;
  sigaction(SIGALRM, &ends, nullptr);
  sigset_t alarm;
  sigemptyset(&alarm);
  sigaddset(&alarm, SIGALRM);
  pthread_sigmask(SIG_UNBLOCK, &alarm, nullptr);
  itimerval timer{};
  timer.it_value.tv_sec = limit.count() / 1000;
  timer.it_value.tv_usec = limit.count() % 1000 * 1000;
  setitimer(ITIMER_REAL, &timer, nullptr);
}

}  // namespace hapticd::server
