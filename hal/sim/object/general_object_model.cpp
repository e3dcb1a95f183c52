#include "hal/sim/object/general_object_model.h"

#include <map>

#include "hal/sim/object/general_friction.h"

namespace hapticd::sim {

namespace {

// Elastic curve, skin and stiffness at 4 N are the separable family's (object_model.cpp). What is added:
// Silicone: power and share from seven recorded load-hold-unload cycles (0.1 … 60 s): 0.27 and 0.82 leave 3.5
// % of rms force, each file's stiffness its own. The same recordings ask for next to no rate-independent
// hysteresis (0.02) and do not say whether times depend on depth. That the power law goes on to 1 ms is
// assumed; so is the gel's likeness. Others: assumed, no recording of them was to be had. Foams: a slow,
// small power, a third of the work lost at any rate, air that drains in some 10 ms and resists by Darcy and
// Forchheimer; the sponge more of all. Rubbers and wood: smaller powers, little hysteresis.
const GeneralMaterialParameters kSponge{0.55, 0.12,  1.5, 4.0,
                                        0.50, 0.015, 4.0, {{{0.60, 0.05}, {0.50, 0.12}, {0.40, 0.25}}}};
const GeneralMaterialParameters kFoam{0.50, 0.10,  0.5, 3.0,
                                      0.35, 0.010, 5.0, {{{0.50, 0.04}, {0.40, 0.10}, {0.30, 0.20}}}};
const GeneralMaterialParameters kRubber{0.50, 0.06,  1.0,  1.5,
                                        0.05, 0.005, 20.0, {{{0.40, 0.03}, {0.20, 0.08}, {0.15, 0.15}}}};
const GeneralMaterialParameters kEraser{0.40, 0.05,  0.3,  1.3,
                                        0.05, 0.005, 20.0, {{{0.30, 0.03}, {0.15, 0.08}, {0.10, 0.15}}}};
const GeneralMaterialParameters kSilicone{0.82, 0.27,  1.0,  1.5,
                                          0.05, 0.005, 20.0, {{{0.20, 0.03}, {0.10, 0.06}, {0.05, 0.15}}}};
const GeneralMaterialParameters kGel{0.75, 0.25,  1.0,  1.5,
                                     0.20, 0.050, 10.0, {{{0.20, 0.03}, {0.10, 0.06}, {0.05, 0.15}}}};
const GeneralMaterialParameters kWood{0.30, 0.03,  0.0, 1.0,
                                      0.00, 0.010, 5.0, {{{0.20, 0.03}, {0.10, 0.08}, {0.05, 0.15}}}};

}  // namespace

GeneralMaterialParameters general_material_of(const std::string& object) {
  static const std::map<std::string, const GeneralMaterialParameters*> all{
      {"sponge_block", &kSponge},   {"foam_ball", &kFoam},         {"rubber_ball", &kRubber},
      {"rubber_eraser", &kEraser},  {"sponge_cut", &kSponge},      {"foam_ball_3d", &kFoam},
      {"rubber_ball_3d", &kRubber}, {"silicone_rest", &kSilicone}, {"wood_plate", &kWood},
      {"sticky_gel", &kGel},        {"foam_ridge", &kFoam},        {"phantom", &kSilicone},
      {"phantom_hard", &kSilicone}, {"phantom_soft", &kSilicone}};
  return *all.at(object);
}

std::vector<hal::UncertainParameter> uncertain_of(Plant plant) {
  if (plant == Plant::kSeparable) {
    return {
        {"plant_separable", 1.0, "1",
         "objects relax as the creep law's exact inverse, which flatters it; plant = \"general\" does not"}};
  }
  const GeneralFrictionParameters friction;
  const char* of_object =
      "of silicone, from recordings; other objects have their own, assumed (general_object_model.cpp)";
  return {
      {"plant_general", 1.0, "1",
       "objects by power law, depth, rate and hysteresis; friction by Maxwell-slip: no law of the "
       "estimators"},
      {"fading_power", kSilicone.power, "1", of_object},
      {"fading_share", kSilicone.fading_share, "1", of_object},
      {"friction_load_exponent", friction.load_exponent, "1",
       "assumed, below 1: area grows more slowly than load; recorded seals: 0.26 … 0.38 of the pressure"},
      {"friction_stiffness_exponent", friction.stiffness_exponent, "1", "Hertz and Mindlin: contact radius"},
      {"friction_stribeck_shape", friction.stribeck_shape, "1",
       "assumed; between 0.5 and 1 (Bo and Pavelescu)"},
      {"friction_growth_per_decade", friction.growth_per_decade, "1", "assumed, elastomer on metal"},
  };
}

}  // namespace hapticd::sim
