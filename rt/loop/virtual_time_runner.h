#pragma once

#include "hal/rig.h"
#include "rt/loop/engine.h"

namespace hapticd::rt {

/// Runs an engine where time can wait: virtual or recorded. Before a tick it waits for room in the engine's
/// channels, so that nothing is lost to a slow reader, and an observer reacts at most
/// Engine::kMaxObserverLead ticks late, independently of how fast either thread runs. A reader that does not
/// come within its timeout is waited for no more; an observer is again once it was switched off and on.
///
/// Runs a rig in virtual time. Unfit for a rig in real time: it sleeps in the tick's thread.
class VirtualTimeRunner final : public hal::TickHandler {
 public:
  explicit VirtualTimeRunner(Engine& engine) noexcept : engine_(engine) {}
  hal::DeviceCommand on_tick(const hal::RigSample& sample) noexcept override;

 private:
  void await_reader() noexcept;
  void await_observer(const hal::RigSample& sample) noexcept;

  Engine& engine_;
  bool waits_for_reader_ = true;
  bool waits_for_observer_ = true;
};

}  // namespace hapticd::rt
