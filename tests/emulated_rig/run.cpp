#include "tests/emulated_rig/run.h"

#include <cmath>
#include <stdexcept>
#include <utility>

#include "rt/scene/compose.h"
#include "tests/support/value_of.h"

namespace hapticd::test {

double magnitude(const hal::Vector3& v) noexcept {
  return std::sqrt(dot(v, v));
}

void Run::compose(const RunConfig& config, hal::Rig& rig, std::function<double()> standing_n) {
  turn_ = config.turn;
  tapped_ = std::make_unique<TappedRig>(rig, std::move(standing_n));
  scene_ = value_of(rt::resolve(config.scene, rig.info()));
  pipeline_ = value_of(rt::compose(scene_, rig.info(), config.model));
  engine_ = std::make_unique<rt::Engine>(*tapped_, 65536);
  engine_->preload(pipeline_.get(), scene_.guard);
}

void Run::drain() {
  rt::TickRecord record;
  while (engine().pop_record(record)) {
    if (!keeps_records_) records_.clear();
    records_.push_back(record);
  }
}

rt::EngineOutcome Run::clear() {
  rt::EngineCommand command;
  command.kind = rt::EngineCommand::Kind::kClear;
  return execute(command);
}

void Run::exchange(const rt::SceneSpec* scene) {
  std::unique_ptr<rt::Pipeline> next;
  rt::EngineCommand command;
  command.kind = rt::EngineCommand::Kind::kExchangeScene;
  if (scene != nullptr) {
    const rt::SceneSpec resolved = value_of(rt::resolve(*scene, rig_info()));
    next = value_of(rt::compose(resolved, rig_info()));
    command.guard = resolved.guard;
  } else {
    command.guard = scene_.guard;
  }
  command.pipeline = next.get();
  if (execute(command).status != rt::EngineOutcome::Status::kApplied) {
    throw std::runtime_error("the loop did not take the scene");
  }
  pipeline_ = std::move(next);
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
