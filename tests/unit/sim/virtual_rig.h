#pragma once

#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <stdexcept>

#include "hal/samples.h"
#include "hal/sim/simulated_rig.h"

namespace hapticd::test {

inline double length(const hal::Vector3& v) {
  return std::sqrt(dot(v, v));
}

inline hal::Vector3 cross(const hal::Vector3& a, const hal::Vector3& b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

/// A simulated rig and the last thing it said; throws with the whole complaint if it refuses.
class VirtualRig {
 public:
  explicit VirtualRig(const sim::SimulationConfig& config) {
    auto created = sim::SimulatedRig::create(config);
    if (!created) throw std::invalid_argument(created.error().text());
    rig_ = std::move(*created);
  }
  VirtualRig(const sim::SimulationConfig& config, const sim::HandProgram& program) : VirtualRig(config) {
    set_program(program);
  }

  void set_program(const sim::HandProgram& program) {
    if (const auto error = rig_->set_program(program)) throw std::invalid_argument(error->text());
  }
  void set_object(const char* name) {
    if (const auto error = rig_->set_object(name)) throw std::invalid_argument(error->text());
  }

  /// One tick: measure, then command.
  void tick(const hal::Vector3& device_force_n = {}) {
    rig_->read(sample_);
    rig_->truth(truth_);
    rig_->write({device_force_n});
  }
  /// Ticks until `duration_s` later, with `observe()` after each.
  template <class Observe>
  void run(double duration_s, Observe observe, const hal::Vector3& device_force_n = {}) {
    for (const double until_s = time_s() + duration_s; time_s() < until_s - 1e-9;) {
      tick(device_force_n);
      observe();
      if (testing::Test::HasFatalFailure()) return;  // one is enough
    }
  }
  void run(double duration_s, const hal::Vector3& device_force_n = {}) {
    run(
        duration_s, [] {}, device_force_n);
  }

  double time_s() const { return 1e-9 * static_cast<double>(sample_.time_ns); }
  const hal::RigSample& sample() const { return sample_; }
  const hal::TruthSample& truth() const { return truth_; }
  sim::SimulatedRig& rig() { return *rig_; }

 private:
  std::unique_ptr<sim::SimulatedRig> rig_;
  hal::RigSample sample_;
  hal::TruthSample truth_;
};

}  // namespace hapticd::test
