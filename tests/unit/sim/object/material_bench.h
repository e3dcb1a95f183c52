#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <numbers>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "hal/sim/base/random.h"
#include "hal/sim/object/material.h"
#include "hal/sim/object/object_model.h"

namespace hapticd::test {

/// Numbers of a material, to be compared.
template <class Parameters>
auto numbers_of(const Parameters& parameters) {
  return std::bit_cast<std::array<double, sizeof(Parameters) / sizeof(double)>>(parameters);
}
/// The objects, without those that share their matter with one before: what a law of matter promises depends
/// on nothing else of an object.
inline std::vector<std::string> objects_of_different_matter() {
  std::vector<std::string> names;
  std::set<std::pair<std::array<double, sizeof(sim::MaterialParameters) / sizeof(double)>,
                     std::array<double, sizeof(sim::GeneralMaterialParameters) / sizeof(double)>>>
      seen;
  for (const std::string& name : sim::object_preset_names()) {
    const sim::ObjectModel object = *sim::object_preset(name);
    if (seen.emplace(numbers_of(object.material), numbers_of(object.general_material)).second) {
      names.push_back(name);
    }
  }
  return names;
}

/// Only what a test names: linear, without skin or memory.
inline sim::MaterialParameters spring(double stiffness_n_per_mm) {
  return {.stiffness_at_4n_n_per_mm = stiffness_n_per_mm};
}

/// Imposes forces: a tip so light that the material alone says where it goes.
template <class Law>
class ForceControlOf {
 public:
  explicit ForceControlOf(const Law& material) : material_(material) {}
  ForceControlOf(const sim::MaterialParameters& parameters, double step_s) : material_(parameters, step_s) {}

  sim::Material::Step apply(double mean_force_n) {
    constexpr double kComplianceMmPerN = 1e5;
    // Position of the tip without contact, so that the mean force over the step is the wanted one; the
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

// What both laws promise. `matter(step_s)` makes it.

/// Anywhere from 5 mm above to `deepest_mm`, in jumps no hand could make.
template <class Make>
void expect_never_pulls(const Make& matter, double deepest_mm) {
  sim::Random random(11);
  for (const double step_s : {1e-4, 1e-3}) {
    for (const double compliance : {0.0, 1e-4, 1e-2, 1.0}) {
      auto material = matter(step_s);
      for (int i = 0; i < 3000; ++i) {
        const double free_mm = -5.0 + (5.0 + deepest_mm) * random.uniform();
        const sim::Material::Step step = material.advance(free_mm, compliance);
        ASSERT_TRUE(std::isfinite(step.mean_force_n) && std::isfinite(step.force_n));
        ASSERT_GE(step.mean_force_n, 0.0);
        ASSERT_GE(step.force_n, 0.0);
        ASSERT_NEAR(step.depth_mm, free_mm - compliance * step.mean_force_n, 1e-7) << "the tip yields to it";
        ASSERT_GE(material.depression_mm(), 0.0) << "no bulge";
        ASSERT_GE(material.depression_mm(), step.depth_mm - 1e-9) << "no tip inside the matter";
      }
    }
  }
}

template <class Law>
void expect_no_force_without_touch(Law&& material) {
  for (const double free_mm : {-10.0, -1e-3, 0.0}) {
    const sim::Material::Step step = material.advance(free_mm, 1e-3);
    EXPECT_EQ(step.force_n, 0.0);
    EXPECT_EQ(step.mean_force_n, 0.0);
    EXPECT_EQ(step.depth_mm, free_mm);
  }
  EXPECT_EQ(material.depression_mm(), 0.0);
}

/// Presses to the same depth at ever higher speed.
template <class Make>
void expect_faster_is_stiffer(const Make& matter, double depth_mm, const std::vector<double>& mm_per_s) {
  double last_n = 0.0;
  for (const double speed_mm_per_s : mm_per_s) {
    const int steps = 500;
    DepthControlOf tip(matter(depth_mm / speed_mm_per_s / steps));
    double force_n = 0.0;
    for (int i = 1; i <= steps; ++i) force_n = tip.move_to(depth_mm * i / steps).force_n;
    EXPECT_GT(force_n, 1.001 * last_n) << speed_mm_per_s << " mm/s";
    last_n = force_n;
  }
}

inline constexpr double kMassKg = 0.05;
inline constexpr double kWeightN = kMassKg * 9.807;

struct EnergyTolerance {
  double relative, absolute_n_mm;
};

/// Drops a mass from each height: in the air it has no more energy than in the flight before, and in the
/// matter none that the fall did not give it.
template <class Law>
void expect_never_rises_higher(const Law& matter, double step_s, double seconds,
                               const std::vector<double>& heights_mm, const EnergyTolerance& tolerance) {
  for (const double height_mm : heights_mm) {
    MovingMassOf<Law> mass(matter, kMassKg, step_s);
    mass.depth_mm = -height_mm;
    const double start_n_mm = kWeightN * height_mm;
    double bound_n_mm = start_n_mm, last_n_mm = start_n_mm;
    for (int i = 0; i < static_cast<int>(seconds / step_s); ++i) {
      mass.step(kWeightN);
      ASSERT_TRUE(std::isfinite(mass.depth_mm));
      const double above_n_mm = mass.kinetic_n_mm() - kWeightN * mass.depth_mm;
      if (mass.depth_mm <= 0.0) {
        ASSERT_LE(above_n_mm, bound_n_mm * (1.0 + tolerance.relative) + tolerance.absolute_n_mm)
            << height_mm << " mm, step " << i;
        last_n_mm = above_n_mm;
      } else {
        bound_n_mm = last_n_mm;
        ASSERT_LE(above_n_mm, start_n_mm + 1e-9 + tolerance.absolute_n_mm);
      }
    }
  }
}

/// Depths every 10 ms of a mass pressed into the matter by a force that swells and ebbs without letting go.
template <class Law>
std::vector<double> pressed_path_mm(const Law& material, double step_s) {
  MovingMassOf<Law> mass(material, 0.05, step_s);
  std::vector<double> path_mm;
  const int steps = static_cast<int>(std::lround(0.3 / step_s));
  const int every = static_cast<int>(std::lround(0.01 / step_s));
  for (int i = 0; i < steps; ++i) {
    const double t_s = (i + 0.5) * step_s;
    const double swell = std::sin(0.5 * std::numbers::pi * std::min(1.0, t_s / 0.06));
    mass.step(2.0 * swell * swell * (1.0 + 0.4 * std::sin(2.0 * std::numbers::pi * 12.0 * t_s)));
    if ((i + 1) % every == 0) path_mm.push_back(mass.depth_mm);
  }
  return path_mm;
}
inline double worst_difference(const std::vector<double>& a, const std::vector<double>& b) {
  double worst = 0.0;
  for (std::size_t i = 0; i < a.size(); ++i) worst = std::max(worst, std::abs(a[i] - b[i]));
  return worst;
}

}  // namespace hapticd::test
