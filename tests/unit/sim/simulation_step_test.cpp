// The step is a matter of accuracy, not of what happens.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "hal/sim/simulation.h"

namespace hapticd::sim {
namespace {

std::vector<double> heights_mm(double step_s, int ms) {
  Simulation simulation(*device_preset("phantom_1_0"), 9.35e-3, 1, {}, step_s);
  PlacedObject object(*object_preset("rubber_ball"), Tip::kRod, step_s);
  const PreparedHand hand = simulation.prepare({.kind = HandProgram::Kind::kPress});
  simulation.set_object(&object);
  simulation.set_hand(&hand);
  std::vector<double> heights;
  for (int i = 1; i <= ms; ++i) {
    while (simulation.time_ns() < i * 1'000'000LL) {
      // A force that comes and goes: latency and amplifier are in the comparison, too.
      simulation.command({0.0, 0.0, i % 400 < 200 ? 0.3 : 0.0});
      simulation.step();
    }
    heights.push_back(simulation.truth().tip_position_mm.z);
  }
  return heights;
}

TEST(SimulationStep, FinerOnesComeCloserToTheFinest) {
  constexpr int kMs = 2500;
  const std::vector<double> reference = heights_mm(1e-5, kMs);
  EXPECT_LT(reference.back(), -0.5) << "the press reached the object";
  double coarser_mm = 0.2;
  for (const double step_s : {5e-4, 1e-4, 2e-5}) {
    const std::vector<double> heights = heights_mm(step_s, kMs);
    double largest_mm = 0.0;
    for (std::size_t i = 0; i < heights.size(); ++i) {
      largest_mm = std::max(largest_mm, std::abs(heights[i] - reference[i]));
    }
    EXPECT_LT(largest_mm, coarser_mm) << step_s;
    coarser_mm = largest_mm;
  }
  EXPECT_LT(coarser_mm, 0.01);
}

}  // namespace
}  // namespace hapticd::sim
