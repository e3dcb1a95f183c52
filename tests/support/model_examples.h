#pragma once

#include <cmath>
#include <limits>
#include <string>

#include "rt/model/identified_model.h"

namespace hapticd::test {

/// Identified models as an identification leaves them, made up: of every kind one, distinguished by `number`.
inline rt::IdentifiedModel example_base(const std::string& object, int number) {
  rt::IdentifiedModel model;
  model.object = object;
  model.device = "phantom_1_0";
  model.sensor = "nano17_si_25";
  model.procedure = "palpation, \"recursive\" then batch; ε = 0.02";
  model.data_reference = "session-" + std::to_string(number);
  model.parameters = {{"exponent", "1", 1.5 + 1e-3 * number, 0.01},
                      {"undetermined", "s", 1.0 / 3.0, std::numeric_limits<double>::infinity()}};
  model.validity = {6.1, 80.0, 5.8};
  model.residual = 0.04;
  model.converged = true;
  return model;
}

inline rt::IdentifiedModel example_contact(const std::string& object, int number = 0) {
  rt::IdentifiedModel model = example_base(object, number);
  rt::ContactModel contact;
  auto& law = contact.hunt_crossley.emplace();
  law.parameters = {0.1 + 1e-9 * number, 1.0 / 3.0 * 1e-3, 1.7};
  law.relative_error = 0.07;
  auto& creep = contact.creep.emplace();
  creep.parameters.weight = {0.7, 0.1, 0.1, 0.05, 0.05};
  creep.parameters.max_force_n = 5.8;
  for (std::size_t j = 0; j < creep.parameters.displacement_mm.size(); ++j) {
    creep.parameters.displacement_mm[j] = 0.4 * static_cast<double>(j);
  }
  creep.relative_error = 0.05;
  model.content = contact;
  return model;
}

inline rt::IdentifiedModel example_friction(const std::string& object, rt::Tip tip = rt::Tip::kRod,
                                            int number = 0) {
  rt::IdentifiedModel model = example_base(object, number);
  model.content = rt::FrictionModel{tip, {0.4, 0.8, 1e-4, 1.0}};
  return model;
}

inline rt::IdentifiedModel example_inclusion(const std::string& object, int number = 0) {
  rt::IdentifiedModel model = example_base(object, number);
  model.content =
      rt::InclusionModel{{1.0, -2.0, -24.0}, {1.1, -2.2, 1.0 / 3.0}, {0.018, 5e-5, 2.4}, 5.5, 0.48};
  return model;
}

inline rt::IdentifiedModel example_of_rig(rt::ModelContent content, int number = 0) {
  rt::IdentifiedModel model = example_base("", number);
  model.content = std::move(content);
  model.validity = {};
  return model;
}

inline rt::StructuralModel example_structure(double stiffness_n_per_mm = 2.5) {
  rt::StructuralModel structure;
  structure.stiffness_n_per_mm = stiffness_n_per_mm;
  structure.gradient_per_mm = {0.001, 0.0, -0.0};
  structure.curvature_per_mm2 = {1e-5, 0.0, 0.0, 0.0, 0.0, 2e-6};
  structure.covered_from_mm = {-20.0, -20.0, -10.0};
  structure.covered_to_mm = {20.0, 20.0, 10.0};
  return structure;
}

inline rt::ToolModel example_tool(double mass_g = 11.5) {
  rt::ToolModel tool;
  tool.mass_g = mass_g;
  tool.centre_mm = {0.1, -0.2, 31.0};
  tool.force_bias_n = {0.01, 0.02, -0.03};
  const double half = 0.5 * 3.0 * 3.14159265358979 / 180.0;
  tool.sensor_to_tool = {std::cos(half), 0.0, 0.0, std::sin(half)};
  return tool;
}

}  // namespace hapticd::test
