#pragma once

#include <pthread.h>
#include <sched.h>

namespace hapticd::test {

/// Gives the priority, if it is permitted, to threads and processes while they are started: they inherit it
/// from the thread that starts them. Without it a machine that others use too lets most ticks go by without a
/// fresh force.
class PriorityWhileStarting {
 public:
  explicit PriorityWhileStarting(int fifo_priority) {
    if (fifo_priority == 0) return;
    pthread_getschedparam(pthread_self(), &policy_, &parameter_);
    sched_param wanted{};
    wanted.sched_priority = fifo_priority;
    granted_ = pthread_setschedparam(pthread_self(), SCHED_FIFO, &wanted) == 0;
  }
  ~PriorityWhileStarting() {
    if (granted_) pthread_setschedparam(pthread_self(), policy_, &parameter_);
  }
  PriorityWhileStarting(const PriorityWhileStarting&) = delete;
  PriorityWhileStarting& operator=(const PriorityWhileStarting&) = delete;

 private:
  int policy_ = SCHED_OTHER;
  sched_param parameter_{};
  bool granted_ = false;
};

}  // namespace hapticd::test
