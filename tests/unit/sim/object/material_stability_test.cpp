// Numbers behind the matter: energy, boundedness, order of convergence.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>
#include <vector>

#include "hal/sim/object/object_model.h"
#include "material_bench.h"

namespace hapticd::sim {
namespace {

using test::MovingMass;

struct Landing {
  std::string name;
  MaterialParameters parameters;
  double step_s;
  friend void PrintTo(const Landing& landing, std::ostream* out) { *out << landing.name; }
};

std::vector<Landing> landings() {
  std::vector<Landing> all;
  for (const double step_s : {1e-4, 1e-3}) {
    const std::string at = step_s < 5e-4 ? "_0p1ms" : "_1ms";
    all.push_back({"wood_plate" + at, object_preset("wood_plate")->material, step_s});
    all.push_back({"rubber_eraser" + at, object_preset("rubber_eraser")->material, step_s});
    all.push_back({"sponge_block" + at, object_preset("sponge_block")->material, step_s});
    all.push_back({"linear_1000" + at, test::spring(1000.0), step_s});
  }
  return all;
}

class Drop : public testing::TestWithParam<Landing> {};
INSTANTIATE_TEST_SUITE_P(Materials, Drop, testing::ValuesIn(landings()),
                         [](const auto& tested) { return tested.param.name; });

using test::kMassKg;
using test::kWeightN;

TEST_P(Drop, ABouncingMassNeverRisesHigherThanBefore) {
  const auto& [name, parameters, step_s] = GetParam();
  test::expect_never_rises_higher(Material(parameters, step_s), step_s, 3.0, {0.1, 1.0, 10.0, 100.0},
                                  {1e-9, 0.0});
}

TEST_P(Drop, AMassComesToRestWhereTheMatterCarriesIt) {
  if (GetParam().name.starts_with("linear")) return;  // nothing in it dissipates
  MovingMass mass(GetParam().parameters, kMassKg, GetParam().step_s);
  mass.depth_mm = -5.0;
  Material::Step last;
  for (int i = 0; i < static_cast<int>(20.0 / GetParam().step_s); ++i) last = mass.step(kWeightN);
  EXPECT_NEAR(mass.velocity_mm_per_s, 0.0, 0.02);
  EXPECT_NEAR(last.force_n, kWeightN, 1e-3);
}

TEST(Drop, ASpringsContactLastsHalfACycle) {
  // A mass that hits a linear spring leaves after π √(m/k) with its speed turned round.
  constexpr double kStiffness = 2.0, kStepS = 1e-5;
  MovingMass mass(test::spring(kStiffness), kMassKg, kStepS);
  mass.depth_mm = -1e-3;
  mass.velocity_mm_per_s = 100.0;
  double contact_s = 0.0, deepest_mm = 0.0;
  while (mass.depth_mm > -0.5) {
    if (mass.step(0.0).mean_force_n > 0.0) contact_s += kStepS;
    deepest_mm = std::max(deepest_mm, mass.depth_mm);
  }
  const double omega = std::sqrt(1e3 * kStiffness / kMassKg);
  EXPECT_NEAR(contact_s, std::numbers::pi / omega, 2.0 * kStepS);
  EXPECT_NEAR(deepest_mm, 100.0 / omega, 1e-3 * 100.0 / omega);
  EXPECT_NEAR(mass.velocity_mm_per_s, -100.0, 0.01);
}

class Convergence : public testing::TestWithParam<std::string> {};
INSTANTIATE_TEST_SUITE_P(Presets, Convergence,
                         testing::Values("sponge_block", "foam_ball", "rubber_ball", "rubber_eraser",
                                         "sponge_cut", "silicone_rest"),
                         [](const auto& tested) { return tested.param; });

TEST_P(Convergence, IsOfSecondOrderInContact) {
  const MaterialParameters parameters = object_preset(GetParam())->material;
  const auto path_mm = [&](double step_s) {
    return test::pressed_path_mm(Material(parameters, step_s), step_s);
  };
  const auto reference = path_mm(1e-3 / 2.0 / 64.0);
  const double coarse_mm = test::worst_difference(path_mm(1e-3), reference);
  const double fine_mm = test::worst_difference(path_mm(0.5e-3), reference);
  const double finer_mm = test::worst_difference(path_mm(0.25e-3), reference);
  const double order = std::log2(fine_mm / finer_mm);
  RecordProperty("order", std::to_string(order));
  RecordProperty("error_mm_at_1_ms", std::to_string(coarse_mm));
  EXPECT_GE(order, 1.7) << coarse_mm << " mm, " << fine_mm << " mm, " << finer_mm << " mm";
  EXPECT_GE(std::log2(coarse_mm / fine_mm), 1.5) << coarse_mm << " mm, " << fine_mm << " mm";
}

}  // namespace
}  // namespace hapticd::sim
