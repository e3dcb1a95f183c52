#include "client/cpp/stop/ahead.h"

#include <sched.h>
#include <sys/syscall.h>
#include <unistd.h>

namespace hapticd::client {

namespace {

constexpr std::uint64_t kShortestSliceNs = 100'000;

}  // namespace

// glibc has no functions for these two calls.
Ahead::Ahead() noexcept {
  if (syscall(SYS_sched_getattr, 0, &before_, sizeof before_, 0) != 0) return;
  if (before_.policy == SCHED_FIFO || before_.policy == SCHED_RR) return;
  Schedule raised;
  raised.flags = before_.flags;
  raised.policy = SCHED_RR;
  raised.priority = static_cast<std::uint32_t>(sched_get_priority_min(SCHED_RR));
  is_raised_ = set(raised);
  if (is_raised_) return;
  raised = before_;
  raised.slice_ns = kShortestSliceNs;
  is_raised_ = set(raised);
}

Ahead::~Ahead() {
  if (is_raised_) set(before_);
}

bool Ahead::set(Schedule schedule) noexcept {
  schedule.size = sizeof schedule;
  return syscall(SYS_sched_setattr, 0, &schedule, 0) == 0;
}

}  // namespace hapticd::client
