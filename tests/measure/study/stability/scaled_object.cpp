#include "tests/measure/study/stability/scaled_object.h"

#include <cmath>
#include <stdexcept>

namespace hapticd::study {

namespace {
sim::ObjectModel preset_named(const std::string& name) {
  if (auto preset = sim::object_preset(name)) return *preset;
  throw std::invalid_argument("no object preset '" + name + "'");
}
}  // namespace

sim::ObjectModel scaled_object(const std::string& preset, double stiffness_n_per_mm) {
  sim::ObjectModel object = preset_named(preset);
  sim::MaterialParameters& material = object.material;
  const double scale = stiffness_n_per_mm / material.stiffness_at_4n_n_per_mm;
  material.stiffness_at_4n_n_per_mm = stiffness_n_per_mm;
  material.skin_stiffness_n_per_mm *= scale;
  material.skin_depth_mm /= scale;
  material.skin_viscosity_n_s_per_mm *= std::pow(scale, kViscosityExponent);
  object.shape = sim::Plane{};
  object.inhomogeneity_share = 0.0;
  object.name = preset + ", scaled";
  return object;
}

rt::ObjectModel scaled_model(const rt::ObjectModel& identified, const std::string& preset,
                             double stiffness_n_per_mm) {
  const double scale = stiffness_n_per_mm / preset_named(preset).material.stiffness_at_4n_n_per_mm;
  rt::ObjectModel model = identified;
  if (model.creep) {
    for (double& displacement : model.creep->parameters.displacement_mm) displacement /= scale;
  }
  model.hunt_crossley.reset();
  model.max_displacement_mm /= scale;
  return model;
}

}  // namespace hapticd::study
