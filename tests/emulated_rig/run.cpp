#include "tests/emulated_rig/run.h"

#include <cmath>

namespace hapticd::test {

double magnitude(const hal::Vector3& v) noexcept {
  return std::sqrt(dot(v, v));
}

void Run::drain() {
  rt::TickRecord record;
  while (engine().pop_record(record)) records_.push_back(record);
}

bool Run::until(const std::function<bool()>& condition, double within_s) {
  const double end_s = now_s() + within_s;
  while (true) {
    drain();
    if (!records_.empty() && condition()) return true;
    if (now_s() >= end_s) return false;
    step();
  }
}

void Run::pass(double seconds) {
  until([] { return false; }, seconds);
}

}  // namespace hapticd::test
