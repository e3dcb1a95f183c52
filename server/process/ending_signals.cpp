#include "server/process/ending_signals.h"

#include <pthread.h>

#include <cstring>  // sigabbrev_np

namespace hapticd::server {

namespace {

constexpr int kEnding[] = {SIGHUP,  SIGINT,    SIGQUIT, SIGTERM, SIGUSR1, SIGUSR2,  SIGALRM,
                           SIGPROF, SIGVTALRM, SIGXCPU, SIGPOLL, SIGPWR,  SIGSTKFLT};

bool is_ignored(int number) {
  struct sigaction present {};
  return sigaction(number, nullptr, &present) == 0 && present.sa_handler == SIG_IGN;
}

}  // namespace

sigset_t ending_signals() {
  sigset_t ending;
  sigemptyset(&ending);
  for (const int number : kEnding) sigaddset(&ending, number);
  for (int number = SIGRTMIN; number <= SIGRTMAX; ++number) sigaddset(&ending, number);
  if (is_ignored(SIGHUP)) sigdelset(&ending, SIGHUP);
  return ending;
}

void hold_back_ending_signals() {
  const sigset_t ending = ending_signals();
  pthread_sigmask(SIG_BLOCK, &ending, nullptr);
  signal(SIGPIPE, SIG_IGN);
  signal(SIGXFSZ, SIG_IGN);
}

int await_ending_signal() {
  const sigset_t ending = ending_signals();
  int number = 0;
  while (sigwait(&ending, &number) != 0) {
  }
  return number;
}

std::string name_of_signal(int number) {
  const char* abbreviation = sigabbrev_np(number);
  return abbreviation != nullptr ? std::string("SIG") + abbreviation : "signal " + std::to_string(number);
}

}  // namespace hapticd::server
