#pragma once

#include <algorithm>
#include <memory>
#include <utility>

#include "rt/scene/compose.h"
#include "rt/scene/renderer.h"

namespace hapticd::rt {

/// A renderer and hand-made samples: an ideal spring at depth 0 along -z, no inertia, no noise.
class Bench {
 public:
  explicit Bench(SceneSpec spec = {},
                 const hal::DeviceInfo& device = {"phantom_1_0", 8.5, 1.4, 0.03, 3.5, 75.0}) {
    info_.name = "bench";
    info_.device = device;
    info_.sensor = {"nano17_si_25", 35.0, 1.0 / 640.0, 10000.0, 9.35};
    spec.name = "bench";
    scene_ = *resolve(spec, info_);
    pipeline_ = std::move(*compose(scene_, info_));
    renderer_ = std::make_unique<Renderer>(scene_.guard, info_.rate_hz);
    renderer_->exchange(pipeline_.get(), scene_.guard);
  }

  hal::RigSample at_depth(double depth_mm, double stiffness_n_per_mm) {
    hal::RigSample sample;
    sample.tip_position_mm.z = -depth_mm;
    sample.sensor_force_n.z = stiffness_n_per_mm * std::max(0.0, depth_mm);
    return sample;
  }
  TickRecord tick(hal::RigSample sample) {
    sample.tick = ticks_;
    sample.time_ns = static_cast<std::int64_t>(ticks_) * 1'000'000;
    ++ticks_;
    TickRecord record;
    renderer_->tick(sample, record);
    return record;
  }
  /// Lets so many milliseconds pass without a tick.
  void pass_ms(int ms) { ticks_ += static_cast<std::uint64_t>(ms); }

  TickRecord press(double from_mm, double to_mm, double stiffness, int ticks) {
    TickRecord record;
    for (int i = 1; i <= ticks; ++i)
      record = tick(at_depth(from_mm + (to_mm - from_mm) * i / ticks, stiffness));
    return record;
  }
  /// Free for 50 ticks, then pressed from 5 mm above to this depth.
  TickRecord touch(double depth_mm, double stiffness, int ticks = 1000) {
    press(-5.0, -5.0, stiffness, 50);
    return press(-5.0, depth_mm, stiffness, ticks);
  }
  Renderer& renderer() { return *renderer_; }
  Pipeline& pipeline() { return *pipeline_; }
  const SceneSpec& scene() const { return scene_; }

 private:
  hal::RigInfo info_;
  SceneSpec scene_;
  std::unique_ptr<Pipeline> pipeline_;
  std::unique_ptr<Renderer> renderer_;
  std::uint64_t ticks_ = 0;
};

inline SceneSpec rigid(double target) {
  SceneSpec spec;
  spec.structural_compensation = false;
  spec.target.stiffness_n_per_mm = target;
  return spec;
}

}  // namespace hapticd::rt
