#include "server/process/ending_signals.h"

#include <pthread.h>
#include <sys/syscall.h>
#include <ucontext.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>  // sigabbrev_np

namespace hapticd::server {

namespace {

constexpr int kEnding[] = {SIGHUP,  SIGINT,    SIGQUIT, SIGTERM, SIGUSR2, SIGALRM,
                           SIGPROF, SIGVTALRM, SIGXCPU, SIGPOLL, SIGPWR,  SIGSTKFLT};
constexpr int kStopping[] = {SIGUSR1, SIGTSTP};

bool is_ignored(int number) {
  struct sigaction present {};
  return sigaction(number, nullptr, &present) == 0 && present.sa_handler == SIG_IGN;
}

/// A library may have started a thread before main() in which nothing is blocked: it would take the signal,
/// and its default action is to end the process. Such a thread blocks it from then on and sends it once more,
/// with its sender, so that signalfd() gets it. Async-signal-safe.
void pass_on_stop(int number, siginfo_t* info, void* context) {
  sigaddset(&static_cast<ucontext_t*>(context)->uc_sigmask, number);
  const int saved = errno;
  if (syscall(SYS_rt_sigqueueinfo, getpid(), number, info) != 0) kill(getpid(), number);
  errno = saved;
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

sigset_t stopping_signals() {
  sigset_t stopping;
  sigemptyset(&stopping);
  for (const int number : kStopping) sigaddset(&stopping, number);
  return stopping;
}

void hold_back_ending_signals() {
  for (const sigset_t& held : {ending_signals(), stopping_signals()})
    pthread_sigmask(SIG_BLOCK, &held, nullptr);
  struct sigaction passes_on {};
  passes_on.sa_sigaction = pass_on_stop;
  passes_on.sa_flags = SA_SIGINFO | SA_RESTART;
  for (const int number : kStopping) sigaction(number, &passes_on, nullptr);
  for (const int number : {SIGPIPE, SIGXFSZ, SIGTTIN, SIGTTOU}) signal(number, SIG_IGN);
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
