#include "server/process/crash_guard.h"

#include <signal.h>
#include <sys/mman.h>
#include <unistd.h>

#include <atomic>
#include <cstddef>

#include "hal/rig.h"
#include "server/process/standard_streams.h"

namespace hapticd::server {

namespace {

constexpr int kCrashes[] = {SIGSEGV, SIGBUS, SIGFPE, SIGILL, SIGABRT, SIGSYS, SIGTRAP};
constexpr std::size_t kStackBytes = std::size_t{1} << 16U;

std::atomic<hal::Rig*> the_rig{nullptr};
static_assert(std::atomic<hal::Rig*>::is_always_lock_free);
/// True while this thread is in the handler: a second crash in it is in the handler itself.
thread_local volatile sig_atomic_t is_handling = 0;

void take_default_action() noexcept {
  struct sigaction ends {};
  ends.sa_handler = SIG_DFL;
  for (const int number : kCrashes) sigaction(number, &ends, nullptr);
}

/// Handles a crash. Async-signal-safe, except for the driver's own way of sending its zero.
void on_crash(int number, siginfo_t* info, void*) noexcept {
  if (is_handling == 0) {
    is_handling = 1;
    if (hal::Rig* rig = the_rig.load()) rig->write_zero_in_crash();
    // Without waiting: as long as the process lives, its loop may go on.
    write_if_ready(STDERR_FILENO,
                   "hapticd: crashed; zero force was written where the device's driver could\n");
  }
  take_default_action();
  // A fault occurs again when its instruction is repeated, and abort() sends its signal again; a signal from
  // kill() does not come again.
  if (info == nullptr || info->si_code <= 0) raise(number);
}

class CrashStack {
 public:
  CrashStack() noexcept
      : memory_(mmap(nullptr, kStackBytes, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS | MAP_STACK,
                     -1, 0)) {
    if (memory_ == MAP_FAILED) return;
    stack_t stack{};
    stack.ss_sp = memory_;
    stack.ss_size = kStackBytes;
    sigaltstack(&stack, nullptr);
  }
  ~CrashStack() {
    if (memory_ == MAP_FAILED) return;
    stack_t none{};
    none.ss_flags = SS_DISABLE;
    sigaltstack(&none, nullptr);
    munmap(memory_, kStackBytes);
  }
  CrashStack(const CrashStack&) = delete;
  CrashStack& operator=(const CrashStack&) = delete;

 private:
  void* memory_;
};

}  // namespace

void install_crash_handlers() {
  use_crash_stack();
  struct sigaction caught {};
  caught.sa_sigaction = on_crash;
  caught.sa_flags = SA_SIGINFO | SA_ONSTACK;
  sigemptyset(&caught.sa_mask);
  for (const int number : kCrashes) sigaction(number, &caught, nullptr);
}

void write_zero_in_crash_of(hal::Rig* rig) {
  the_rig.store(rig);
}

void use_crash_stack() noexcept {
  static thread_local const CrashStack stack;
}

}  // namespace hapticd::server
