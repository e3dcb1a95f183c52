#pragma once

#include <cmath>
#include <memory>

#include "hal/samples.h"
#include "hal/sim/simulated_rig.h"
#include "rt/model/models.h"
#include "rt/record/tick_record.h"
#include "rt/scene/pipeline.h"
#include "rt/scene/renderer.h"
#include "rt/scene/scene_spec.h"

namespace hapticd::study {

/// The closed loop of simulated rig and renderer in virtual time, a tick at a time: what the live loop does,
/// without threads or network.
class VirtualRun {
 public:
  /// Throws std::runtime_error with the full complaint if rig or scene are refused. A scene is loaded unless
  /// `with_scene` is false (bare object, no force). `model`: of the object, if the scene needs one.
  VirtualRun(const sim::SimulationConfig& rig, const rt::SceneSpec& scene, bool with_scene = true,
             const rt::ObjectModel* model = nullptr);
  ~VirtualRun();
  VirtualRun(VirtualRun&&) noexcept;

  void set_hand(const sim::HandProgram& program);
  void set_target(double stiffness_n_per_mm, double ramp_s) {
    renderer_->set_target(rt::linear_target(stiffness_n_per_mm), ramp_s);
  }
  void step();
  /// Steps for so long; `observe()` after each.
  template <class Observe>
  void run(double duration_s, Observe observe) {
    const auto ticks = std::lround(duration_s * info().rate_hz);
    for (long i = 0; i < ticks; ++i) {
      step();
      observe();
    }
  }
  void run(double duration_s) {
    run(duration_s, [] {});
  }

  double time_s() const { return 1e-9 * static_cast<double>(sample_.time_ns); }
  const hal::RigSample& sample() const { return sample_; }
  const hal::TruthSample& truth() const { return truth_; }
  const rt::TickRecord& record() const { return record_; }
  const hal::RigInfo& info() const { return rig_->info(); }
  const rt::SceneSpec& scene() const { return scene_; }
  rt::Renderer& renderer() { return *renderer_; }
  rt::Assistance& assistance() { return renderer_->assistance(); }

  /// Force of the hand, positive into the table.
  double hand_force_n() const { return -truth_.hand_force_n.z; }
  /// Force of the device, positive into the table.
  double device_force_n() const { return -truth_.device_force_n.z; }

 private:
  std::unique_ptr<sim::SimulatedRig> rig_;
  rt::SceneSpec scene_;
  std::unique_ptr<rt::Pipeline> pipeline_;
  std::unique_ptr<rt::Renderer> renderer_;
  hal::RigSample sample_;
  hal::TruthSample truth_;
  rt::TickRecord record_;
};

}  // namespace hapticd::study
