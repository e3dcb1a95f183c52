#pragma once

#include <memory>

#include "object_model.h"
#include "rt/friction/dahl.h"
#include "rt/scene/compose.h"
#include "rt/scene/renderer.h"
#include "rt/signal/tool_load.h"
#include "tests/unit/rt/deformation/directions.h"

namespace hapticd::rt::test {

/// A renderer with an explore scene, and an ideal object: an elastic half-space with its surface at z = 0
/// and friction, seen by a rigid device without noise.
class ExploreBench {
 public:
  explicit ExploreBench(SceneSpec spec, const ObjectModel& model = bench_model(),
                        const std::string& device = "phantom_1_5_high_force", double coulomb_friction_n = 0.0)
      : info_(bench_rig(device)) {
    info_.device.coulomb_friction_n = coulomb_friction_n;
    scene_ = *resolve(std::move(spec), info_);
    friction_ =
        scene_.tip == Tip::kRod ? *model.rod_friction : model.bearing_friction.value_or(kBallBearingFriction);
    maxwell_slip_ = PlanarMaxwellSlip(friction_.maxwell_slip.value_or(MaxwellSlipParameters{}));
    pipeline_ = std::move(*compose(scene_, info_, &model));
    renderer_ = std::make_unique<Renderer>(scene_.guard, info_.rate_hz);
    renderer_->exchange(pipeline_.get(), scene_.guard);
  }

  /// What the sensor reads of this force on a tool that is held like this.
  hal::Vector3 sensed_n(const hal::Vector3& reaction_n, const hal::Quaternion& orientation = {}) const {
    const double weight_n = 1e-6 * scene_.tool_mass_g * ToolLoad::kGravityMmPerS2;
    return rotated(inverse(orientation), reaction_n + hal::Vector3{0.0, 0.0, -weight_n}) -
           scene_.explore.gravity_at_bias * weight_n;
  }
  /// The object's answer to a tip at `tip_mm`.
  hal::RigSample at(const hal::Vector3& tip_mm, const hal::Quaternion& orientation = {}) {
    const double normal_n = kObjectNPerMm * std::max(0.0, -tip_mm.z);
    hal::Vector3 slide = tip_mm - last_tip_mm_;
    slide.z = 0.0;
    if (friction_.maxwell_slip) {
      if (normal_n == 0.0) maxwell_slip_.release();
      built_up_ = maxwell_slip_.step(slide, {0.0, 0.0, 1.0}) * (1.0 / friction_.kinetic);
    } else {
      built_up_ = normal_n > 0.0 ? dahl_step(built_up_, slide, friction_.presliding_mm) : hal::Vector3{};
    }
    last_tip_mm_ = tip_mm;
    hal::RigSample sample;
    sample.tip_position_mm = tip_mm;
    sample.tip_orientation = orientation;
    sample.sensor_force_n =
        sensed_n(built_up_ * (-friction_.kinetic * normal_n) + hal::Vector3{0.0, 0.0, normal_n}, orientation);
    sample.sensor_force_n.y += ticks_ % 2 == 0 ? trembles_n_ : -trembles_n_;
    sample.force_count = 10;
    return sample;
  }
  /// Keeps the last digit of the sensor from being still, from now on.
  void tremble() { trembles_n_ = 1e-5; }
  TickRecord tick(hal::RigSample sample) {
    sample.tick = ticks_++;
    sample.time_ns = time_ns_ += period_ns_;
    TickRecord record;
    renderer_->tick(sample, record);
    return record;
  }
  TickRecord rest(const hal::Vector3& tip_mm, int ticks) { return move(tip_mm, tip_mm, ticks); }
  TickRecord move(const hal::Vector3& from_mm, const hal::Vector3& to_mm, int ticks) {
    TickRecord record;
    for (int i = 1; i <= ticks; ++i) {
      const double share = static_cast<double>(i) / ticks;
      record = tick(at(from_mm + (to_mm - from_mm) * (share * share * (3.0 - 2.0 * share))));
    }
    return record;
  }
  /// Presses from 10 mm above, at rest: down onto the object at (x, y) to 4 mm, held for a second and a half.
  TickRecord press_and_hold() {
    rest({0.0, 0.0, 10.0}, 300);
    move({0.0, 0.0, 10.0}, {0.0, 0.0, -4.0}, 1000);
    return rest({0.0, 0.0, -4.0}, 1500);
  }
  Renderer& renderer() { return *renderer_; }
  Pipeline& pipeline() { return *pipeline_; }
  const SceneSpec& scene() const { return scene_; }
  const hal::RigInfo& info() const { return info_; }
  /// Time between this and later samples, and the time of the last one.
  void set_period_ns(std::int64_t period_ns) { period_ns_ = period_ns; }
  void set_time_ns(std::int64_t time_ns) { time_ns_ = time_ns; }
  std::int64_t time_ns() const { return time_ns_; }

 private:
  hal::RigInfo info_;
  SceneSpec scene_;
  FrictionParameters friction_;
  std::unique_ptr<Pipeline> pipeline_;
  std::unique_ptr<Renderer> renderer_;
  PlanarMaxwellSlip maxwell_slip_{MaxwellSlipParameters{}};
  hal::Vector3 built_up_;
  hal::Vector3 last_tip_mm_;
  double trembles_n_ = 0.0;
  std::uint64_t ticks_ = 0;
  std::int64_t period_ns_ = 1'000'000;
  std::int64_t time_ns_ = 0;
};

/// The three scenes as shipped and as published, and every alternative of a stage once.
inline std::vector<SceneSpec> all_explore_scenes() {
  std::vector<SceneSpec> scenes{explore_scene(Tip::kRod), explore_scene(Tip::kBallBearing),
                                dissertation_scene(Tip::kRod), dissertation_scene(Tip::kBallBearing)};
  SceneSpec other = explore_scene(Tip::kRod);
  other.name = "fused_hunt_crossley_fading";
  other.explore.law = ContactLawKind::kHuntCrossley;
  other.explore.release = ReleaseMethod::kFade;
  other.compensation.lead_ms = 3.0;
  scenes.push_back(other);
  other = explore_scene(Tip::kRod);
  other.name = "inverse_creep_cancelled";
  other.explore.displacement = DisplacementEstimator::kInverse;
  other.explore.friction_feel = FrictionFeel::kCancelled;
  scenes.push_back(other);
  other = explore_scene(Tip::kBallBearing);
  other.name = "recursive_bearing";
  other.explore.displacement = DisplacementEstimator::kRecursive;
  scenes.push_back(other);
  for (const double scale : {0.5, 2.0}) {
    other = explore_scene(Tip::kRod);
    other.name = scale < 1.0 ? "less_friction" : "more_friction";
    other.friction_target.emplace().scale = scale;
    scenes.push_back(other);
  }
  other = explore_scene(Tip::kRod);
  other.name = "transient";
  other.transient.emplace().target = {{100.0, 80.0, 15.0}};
  other.transient->real = {{60.0, 100.0, 5.0}};
  scenes.push_back(other);
  return scenes;
}

}  // namespace hapticd::rt::test
