// Every kind of identification over real drivers. On the board in virtual time to its end; live, over the
// vendor's library, only that it listens.

#include <gtest/gtest.h>

#include <cstdio>
#include <string>

#include "server/identification/session/contact/contact_identification.h"
#include "server/identification/session/structural_identification.h"
#include "tests/emulated_rig/board_rig.h"
#include "tests/emulated_rig/emulated_rig.h"
#include "tests/emulated_rig/identify_run.h"
#include "tests/support/turn.h"
#include "tests/support/value_of.h"

namespace hapticd::test {
namespace {

/// Both of the press and of the line.
struct Placed {
  hal::Vector3 press, line;
};
constexpr Placed kUpright{{0.0, 0.0, -1.0}, {1.0, 0.0, 0.0}};

sim::SimulationConfig world(const std::string& device, const std::string& object, const std::string& tip) {
  return {.device = device, .object = object, .tip = tip};
}

RunConfig placed(RunConfig config, const Placed& place) {
  if (place.press.z != -1.0 || place.line.x != 1.0) config.turn = turn_of_world(place.press, place.line);
  return config;
}

/// Runs to its end on the board; the model.
template <class Identification, class Task>
rt::IdentifiedModel identified_on_board(const RunConfig& config, const Task& task, SeenAs seen_as,
                                        const Placed& place = kUpright, double limit_s = 120.0) {
  BoardRig rig(placed(config, place));
  Identification identification(task, rig.rig_info());
  const IdentifyRunResult result = identify_on(
      rig, identification, {seen_as, {place.press, place.line}, config.simulation.tool_mass_g, limit_s});
  EXPECT_GT(result.converged_s, 0.0) << "not within " << limit_s << " s; missing: "
                                     << (result.progress.missing.empty() ? ""
                                                                         : result.progress.missing.front());
  EXPECT_EQ(result.latched, rt::GuardFault::kNone);
  if (testing::Test::HasFailure()) {
    for (const std::string& remark : result.progress.remarks) std::printf("remark: %s\n", remark.c_str());
  }
  auto model = identification.finish();
  EXPECT_TRUE(model) << model.error().text();
  return model ? *model : rt::IdentifiedModel{};
}

// One place in which press and line point along no axis, and one in which only the line is turned.
TEST(InAnyDirection, ASpongeIsTheSameOnTheBoard) {
  const RunConfig config = rig_for_identification(world("phantom_1_0", "sponge_cut", "ball_bearing"));
  const auto deepest_mm = [&config](const Placed& place) {
    return identified_on_board<identification::ContactIdentification>(config, identification::ContactTask{},
                                                                      SeenAs::kUpright, place)
        .validity.max_displacement_mm;
  };
  const double upright_mm = deepest_mm(kUpright);
  EXPECT_NEAR(deepest_mm({{1.0, -1.0, -0.5}, {0.0, 1.0, -1.0}}) / upright_mm, 1.0, 0.05);
  EXPECT_NEAR(deepest_mm({{0.0, 0.0, -1.0}, {0.3, 1.0, 0.0}}) / upright_mm, 1.0, 0.05);
}

TEST(OnTheBoard, StructuralStiffnessByAnInstrumentOnIt) {
  RunConfig config = rig_for_identification(world("phantom_1_0", "none", "rod"));
  config.instrument_mm_per_v = 25.0;
  identification::StructuralStiffnessTask task{.constant = true};
  const rt::IdentifiedModel model = identified_on_board<identification::StructuralIdentification>(
      config, task, SeenAs::kRaw, kUpright, 240.0);
  EXPECT_NEAR(std::get<rt::StructuralModel>(model.content).stiffness_n_per_mm, 3.5, 0.1);
}

TEST(OnTheBoard, StructuralStiffnessOfARigidContact) {
  const RunConfig config = rig_for_identification(world("phantom_1_0", "wood_plate", "rod"));
  identification::StructuralStiffnessTask task{.rigid_contact = true};
  const rt::IdentifiedModel model = identified_on_board<identification::StructuralIdentification>(
      config, task, SeenAs::kRaw, kUpright, 240.0);
  EXPECT_NEAR(std::get<rt::StructuralModel>(model.content).stiffness_n_per_mm, 3.5, 0.35);
}

TEST(ALiveMix, OfTheVendorsLibraryAndASensorOnTheBoardIdentifies) {
  EmulatedRigConfig config;
  static_cast<RunConfig&>(config) =
      rig_for_identification(world("phantom_1_0", "sponge_cut", "ball_bearing"));
  config.sensor_on_board = true;
  config.instrument_mm_per_v = 25.0;
  config.stall_s = 2.0;
  EmulatedRig rig(config);
  identification::ContactIdentification identification(identification::ContactTask{}, rig.rig_info());
  const IdentifyRunResult result =
      identify_on(rig, identification, {SeenAs::kUpright, {}, config.simulation.tool_mass_g, 10.0});
  // How far it comes in this time is a matter of the machine.
  EXPECT_GT(result.progress.samples, 500U);
  EXPECT_FALSE(result.progress.parameters.empty());
  EXPECT_GT(result.external_readings, 500U) << "the instrument listens to the same scans";
}

}  // namespace
}  // namespace hapticd::test
