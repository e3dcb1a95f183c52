#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "hal/error.h"
#include "hal/samples.h"
#include "rt/loop/spsc_ring.h"
#include "rt/scene/pipeline.h"
#include "rt/scene/renderer.h"
#include "rt/scene/scene_spec.h"

namespace hapticd::bench {

/// Names of the scenes that are measured.
const std::vector<std::string>& tick_scenes();

/// What runs in a tick.
enum class Extent : std::uint8_t {
  kComposed,    ///< the stages the scene needs
  kEverything,  ///< those and the stages of every other kind of scene, as a loop would that leaves nothing
                ///< out
};

/// A scene and the samples it is fed: two seconds of taps (in 3D: of strokes) by the simulated hand, recorded
/// with the very scene in the loop. The same on every machine.
class TickWorkload {
 public:
  /// `extent`: the scene as it is composed, or with all that any scene has forced on.
  static hal::Result<std::unique_ptr<TickWorkload>> create(const std::string& scene,
                                                           Extent extent = Extent::kComposed);

  /// One tick as the loop does it: the scene's computation, and its record into the telemetry ring, which
  /// another thread reads. The samples come round and round.
  void tick() noexcept {
    take(samples_[next_]);
    if (++next_ == samples_.size()) next_ = 0;
  }
  /// The tool is laid down where the last tick() found it: from now on nothing moves, the sensor reads zero.
  void lay_down() noexcept;
  /// One tick after that.
  void rest() noexcept {
    still_.time_ns += period_ns_;
    take(still_);
  }

  /// The sample the next tick takes, and whether it is one in contact.
  std::size_t next() const noexcept { return next_; }
  bool in_contact(std::size_t index) const noexcept { return in_contact_[index]; }
  std::size_t size() const noexcept { return samples_.size(); }
  double contact_share() const noexcept;
  const rt::SceneOutline& outline() const noexcept { return outline_; }
  /// Memory of the composed stages and of what runs and guards them.
  std::size_t memory_bytes() const noexcept { return memory_bytes_; }
  /// Time from the scene's text, read, to its first tick: checking and composing.
  double compose_ns() const noexcept { return compose_ns_; }
  /// What the next tick shows.
  rt::TickRecord next_record() noexcept;
  /// True as long as the guard lets the scene through; a latched tick would be a cheap one.
  bool renders() const noexcept { return guard_state_ == rt::GuardState::kRendering; }

 private:
  TickWorkload(const rt::SceneSpec& resolved, std::unique_ptr<rt::Pipeline> pipeline, double rate_hz);
  void take(const hal::RigSample& sample) noexcept {
    sink_ = renderer_.tick(sample, *ring_.claim());  // read at once below: never full
    ring_.publish();
    if (const rt::TickRecord* reported = ring_.front(); reported != nullptr) {
      guard_state_ = reported->guard_state;
      ring_.discard();
    }
  }

  rt::SpscRing<rt::TickRecord> ring_{64};
  std::unique_ptr<rt::Pipeline> pipeline_;
  rt::Renderer renderer_;
  std::vector<hal::RigSample> samples_;
  std::vector<bool> in_contact_;
  hal::RigSample still_;  ///< of rest()
  std::int64_t period_ns_;
  std::size_t next_ = 0;
  rt::GuardState guard_state_{};
  hal::DeviceCommand sink_;
  rt::SceneOutline outline_;
  std::size_t memory_bytes_ = 0;
  double compose_ns_ = 0.0;
};

}  // namespace hapticd::bench
