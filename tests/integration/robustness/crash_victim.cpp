// Crashes in the way it is reported, with a rig whose "zero" is a line on standard output.
//
//   crash_victim
//   segv|bus|fpe|ill|abort|terminate|overflow|overflow_in_thread|killed|unread|crash_in_driver|none
#include <signal.h>
#include <unistd.h>

#include <cstdlib>
#include <cstring>
#include <exception>
#include <string_view>
#include <thread>

#include "hal/rig.h"
#include "server/process/crash_guard.h"
#include "tests/support/full_pipe.h"

using namespace hapticd;

namespace {

bool driver_crashes = false;

class RigOfOneLine final : public hal::Rig {
 public:
  const hal::RigInfo& info() const noexcept override { return info_; }
  bool owns_clock() const noexcept override { return false; }
  void read(hal::RigSample&) noexcept override {}
  void write(const hal::DeviceCommand&) noexcept override {}
  void write_zero_in_crash() noexcept override {
    constexpr char kLine[] = "zero\n";
    if (write_(kLine, sizeof kLine - 1) && driver_crashes) abort();
  }

 private:
  static bool write_(const char* text, std::size_t length) {
    return ::write(STDOUT_FILENO, text, length) == static_cast<ssize_t>(length);
  }
  hal::RigInfo info_;
};

volatile int never_zero = 1;

/// Uses up the stack.
int overflow(int depth) {  // NOLINT(misc-no-recursion)
  volatile char ballast[4096];
  std::memset(const_cast<char*>(ballast), depth, sizeof ballast);
  return never_zero != 0 ? overflow(depth + 1) + ballast[depth % 4096] : 0;
}

void crash(std::string_view way) {
  if (way == "segv") *static_cast<volatile int*>(nullptr) = 1;  // NOLINT
  if (way == "bus") raise(SIGBUS);
  if (way == "fpe") raise(SIGFPE);
  if (way == "ill") __builtin_trap();
  if (way == "abort") std::abort();
  if (way == "terminate") std::terminate();
  if (way == "overflow") std::exit(overflow(0));
  if (way == "overflow_in_thread") {
    std::thread([] {
      server::use_crash_stack();
      std::exit(overflow(0));
    }).join();
  }
  if (way == "killed") {
    kill(getpid(), SIGSEGV);
    for (;;) pause();
  }
  if (way == "unread") {
    const test::FullPipe pipe;
    dup2(pipe.in(), STDERR_FILENO);
    std::abort();
  }
  if (way == "crash_in_driver") {
    driver_crashes = true;
    *static_cast<volatile int*>(nullptr) = 1;  // NOLINT
  }
  if (way == "crash_in_thread") {
    std::thread([] { *static_cast<volatile int*>(nullptr) = 1; }).join();  // NOLINT
  }
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 2) return 2;
  RigOfOneLine rig;
  server::install_crash_handlers();
  server::write_zero_in_crash_of(&rig);
  crash(argv[1]);
  server::write_zero_in_crash_of(nullptr);
  crash("abort");  // "none": a crash when there is no rig any more
}
