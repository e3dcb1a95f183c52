#pragma once

#include <cmath>

#include "hal/sim/object/material.h"

namespace hapticd::test {

/// Only what a test names: linear, without skin or memory.
inline sim::MaterialParameters spring(double stiffness_n_per_mm) {
  sim::MaterialParameters p;
  p.stiffness_at_4n_n_per_mm = stiffness_n_per_mm;
  return p;
}

/// Imposes forces: a tip so light that the material alone says where it goes.
template <class Law>
class ForceControlOf {
 public:
  explicit ForceControlOf(const Law& material) : material_(material) {}
  ForceControlOf(const sim::MaterialParameters& parameters, double step_s) : material_(parameters, step_s) {}

  sim::Material::Step apply(double mean_force_n) {
    constexpr double kComplianceMmPerN = 1e5;
    // Where the tip would be without contact, so that the mean force over the step is the wanted one; the
    // depth's change within the step leaves an error of change / compliance.
    last_ = material_.advance(last_.depth_mm + kComplianceMmPerN * mean_force_n, kComplianceMmPerN);
    return last_;
  }
  Law& material() { return material_; }

 private:
  Law material_;
  sim::Material::Step last_;
};
using ForceControl = ForceControlOf<sim::Material>;

/// Imposes depths: a tip that nothing holds back.
template <class Law>
class DepthControlOf {
 public:
  explicit DepthControlOf(const Law& material) : material_(material) {}
  DepthControlOf(const sim::MaterialParameters& parameters, double step_s) : material_(parameters, step_s) {}

  sim::Material::Step move_to(double depth_mm) {
    last_ = material_.advance(depth_mm, 0.0);
    work_n_mm_ += last_.mean_force_n * (depth_mm - depth_mm_);
    depth_mm_ = depth_mm;
    return last_;
  }
  double work_n_mm() const { return work_n_mm_; }  ///< done on the material so far
  double depth_mm() const { return depth_mm_; }
  Law& material() { return material_; }

 private:
  Law material_;
  sim::Material::Step last_;
  double depth_mm_ = 0.0;
  double work_n_mm_ = 0.0;
};
using DepthControl = DepthControlOf<sim::Material>;

/// A mass moving on the material, pushed by an outer force (positive into the object). Constant forces over a
/// step move a mass exactly this way.
template <class Law>
class MovingMassOf {
 public:
  MovingMassOf(const Law& material, double mass_kg, double step_s)
      : material_(material), mass_kg_(mass_kg), step_s_(step_s) {}
  MovingMassOf(const sim::MaterialParameters& parameters, double mass_kg, double step_s)
      : material_(parameters, step_s), mass_kg_(mass_kg), step_s_(step_s) {}

  double depth_mm = 0.0;
  double velocity_mm_per_s = 0.0;

  sim::Material::Step step(double outer_force_n) {
    const double per_n_mm_per_s2 = 1e3 / mass_kg_;
    const double compliance = 0.5 * step_s_ * step_s_ * per_n_mm_per_s2;
    const double free_mm = depth_mm + velocity_mm_per_s * step_s_ + compliance * outer_force_n;
    const sim::Material::Step done = material_.advance(free_mm, compliance);
    depth_mm = free_mm - compliance * done.mean_force_n;
    velocity_mm_per_s += (outer_force_n - done.mean_force_n) * per_n_mm_per_s2 * step_s_;
    return done;
  }
  double kinetic_n_mm() const { return 0.5e-3 * mass_kg_ * velocity_mm_per_s * velocity_mm_per_s; }
  const Law& material() const { return material_; }

 private:
  Law material_;
  double mass_kg_;
  double step_s_;
};
using MovingMass = MovingMassOf<sim::Material>;

}  // namespace hapticd::test
