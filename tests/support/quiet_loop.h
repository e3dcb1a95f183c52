#pragma once

#include "rt/loop/periodic_loop.h"

namespace hapticd::test {

/// A loop without any of the privileges it would like.
inline rt::LoopConfig quiet_loop() {
  rt::LoopConfig loop;
  loop.fifo_priority = 0;
  loop.lock_memory = false;
  loop.keep_cpu_awake = false;
  return loop;
}

}  // namespace hapticd::test
