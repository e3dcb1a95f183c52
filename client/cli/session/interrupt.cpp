#include "client/cli/session/interrupt.h"

#include <atomic>
#include <csignal>

namespace hapticd::cli {
namespace {
std::atomic<int> signal_caught{0};
static_assert(std::atomic<int>::is_always_lock_free);
}  // namespace

void catch_interrupts() {
  struct sigaction action {};
  action.sa_handler = [](int number) { signal_caught.store(number); };
  // A second one ends the program at once.
  action.sa_flags = static_cast<int>(SA_RESETHAND);
  sigaction(SIGINT, &action, nullptr);
  sigaction(SIGTERM, &action, nullptr);
}

bool interrupted() noexcept {
  return signal_caught.load() != 0;
}

bool terminated() noexcept {
  return signal_caught.load() == SIGTERM;
}

}  // namespace hapticd::cli
