#include "tests/emulated_rig/run.h"

#include <cmath>
#include <utility>

#include "rt/scene/compose.h"
#include "tests/support/value_of.h"

namespace hapticd::test {

double magnitude(const hal::Vector3& v) noexcept {
  return std::sqrt(dot(v, v));
}

void Run::compose(const RunConfig& config, hal::Rig& rig, std::function<double()> standing_n) {
  tapped_ = std::make_unique<TappedRig>(rig, std::move(standing_n));
  scene_ = value_of(rt::resolve(config.scene, rig.info()));
  pipeline_ = value_of(rt::compose(scene_, rig.info(), config.model));
  engine_ = std::make_unique<rt::Engine>(*tapped_, 65536);
  engine_->preload(pipeline_.get(), scene_.guard);
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
