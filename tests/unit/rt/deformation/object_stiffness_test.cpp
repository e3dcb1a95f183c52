#include <gtest/gtest.h>

#include <cmath>

#include "rt/model/models.h"

namespace hapticd::rt {
namespace {

TEST(ObjectStiffness, IsNoneWithoutALaw) {
  EXPECT_FALSE(stiffness_n_per_mm(ObjectModel{}, 4.0));
}

TEST(ObjectStiffness, OfALinearLawIsItsOwnAtAnyForce) {
  ObjectModel model;
  model.hunt_crossley = {{0.5, 1e-3, 1.0}, 0.01};
  for (const double force_n : {1e-3, 4.0, 100.0})
    EXPECT_NEAR(*stiffness_n_per_mm(model, force_n), 0.5, 1e-12);
}

TEST(ObjectStiffness, OfAPowerLawGrowsWithTheForce) {
  ObjectModel model;
  model.hunt_crossley = {{0.1, 1e-3, 2.0}, 0.01};
  EXPECT_NEAR(*stiffness_n_per_mm(model, 4.0), 4.0 / std::sqrt(40.0), 1e-12);
}

TEST(ObjectStiffness, OfACreepLawIsThatOfTheSettledCurve) {
  ObjectModel model;
  model.hunt_crossley = {{5.0, 0.0, 1.0}, 0.1};  // the creep law goes before it
  CreepParameters creep{.weight = {0.5, 0.2, 0.1, 0.1, 0.1}, .max_force_n = 8.0};
  for (std::size_t j = 0; j < CreepParameters::kKnots; ++j) {
    const double share = static_cast<double>(j) / (CreepParameters::kKnots - 1);
    creep.displacement_mm[j] = creep.max_force_n * share * share / 0.25;  // 0.25 N/mm throughout
  }
  model.creep = {creep, 0.01};
  EXPECT_NEAR(*stiffness_n_per_mm(model, 4.0), 0.25, 1e-3);
  EXPECT_NEAR(*stiffness_n_per_mm(model, 16.0), 0.25, 1e-3) << "beyond the last knot a straight line";
}

}  // namespace
}  // namespace hapticd::rt
