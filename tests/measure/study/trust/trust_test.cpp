// In free air the device gives no force, whatever a clock, a sensor or an object does.

#include <gtest/gtest.h>

#include <fstream>
#include <set>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "server/model/model_file.h"
#include "tests/measure/study/common/explore_study.h"
#include "tests/measure/study/common/plant.h"
#include "tests/measure/study/trust/rendered_trial.h"
#include "tests/measure/study/trust/settings_search.h"
#include "tests/measure/study/trust/trust_trial.h"
#include "tests/support/free_air_judge.h"
#include "tests/support/value_of.h"

namespace hapticd::study {

void PrintTo(const TrustCase& trial, std::ostream* out) {
  *out << trial.text();
}

namespace {

using test::FreeAirJudge;

const rt::ObjectModel& foam() {
  static const rt::ObjectModel model = [] {
    std::stringstream text;
    text << std::ifstream(HAPTICD_MODELS "/foam_ball_3d.toml").rdbuf();
    return test::value_of(server::parse_model(text.str(), "foam_ball_3d"));
  }();
  return model;
}

/// The causes of the bounded test, each on one scene, device and rate; which, goes round.
std::vector<TrustCase> tested_cases() {
  std::vector<TrustCase> all;
  const std::vector<std::string> scenes{"tap_1d", "explore_rod", "explore_bearing"};
  std::size_t i = 0;
  for (const TrustCause& cause : trust_causes()) {
    if (!cause.in_test) continue;
    for (int repeat = 0; repeat < 3; ++repeat, ++i) {
      TrustCase trial;
      trial.cause = &cause;
      trial.scene = scenes[i % scenes.size()];
      trial.device = trust_devices()[(i / 3 + i % 3) % 2];
      trial.rate_hz = i % 5 == 4 ? 5000.0 : 1000.0;
      trial.seed = 100 + i;
      trial.duration_s = 14.0;
      all.push_back(trial);
    }
  }
  return all;
}

/// Runs that once pushed: a tool that leaves slowly or at 5 kHz with a zero that jumped under the press, a
/// step across a load that changes, several jumps while the object is left with 1 mm/s, an arm thrown by an
/// edge, an edge that makes a contact swing.
std::vector<TrustCase> hard_cases() {
  struct Hard {
    const char* cause;
    const char* level;
    const char* scene;
    std::size_t device;
    double rate_hz;
    std::uint64_t seed;
  };
  std::vector<TrustCase> all;
  for (const Hard& hard : {Hard{"zero_jump_touched", "0.3 N", "explore_bearing", 0, 5000.0, 1},
                           Hard{"zero_jump_touched", "1 N", "explore_rod", 0, 5000.0, 1},
                           Hard{"zero_jump_touched", "0.1 N", "explore_bearing", 1, 1000.0, 2},
                           Hard{"zero_jump_touched", "2 N", "explore_rod", 1, 1000.0, 1},
                           Hard{"zero_jump_touched", "3 N", "tap_1d", 0, 1000.0, 3},
                           Hard{"zero_jump_touched", "0.15 N", "explore_bearing", 1, 1000.0, 2},
                           Hard{"zero_jump_left", "1 N", "explore_rod", 0, 1000.0, 2},
                           Hard{"zero_jump_left", "1 N", "explore_bearing", 1, 1000.0, 2},
                           Hard{"slid_off_its_edge", "", "tap_1d", 0, 1000.0, 2},
                           Hard{"slid_off_its_edge", "", "tap_1d", 0, 1000.0, 4},
                           Hard{"slid_off_its_edge", "", "explore_rod", 1, 1000.0, 1},
                           Hard{"slid_off_its_edge", "", "explore_rod", 1, 1000.0, 2}}) {
    for (const TrustCause& cause : trust_causes()) {
      if (cause.name != hard.cause || cause.level != hard.level) continue;
      TrustCase trial;
      trial.cause = &cause;
      trial.scene = hard.scene;
      trial.device = trust_devices()[hard.device];
      trial.rate_hz = hard.rate_hz;
      trial.seed = hard.seed;
      all.push_back(trial);
    }
  }
  return all;
}

std::string name_of(const testing::TestParamInfo<TrustCase>& info) {
  std::string name = info.param.text();
  for (char& c : name) {
    if (std::isalnum(static_cast<unsigned char>(c)) == 0) c = '_';
  }
  return name;
}

class NothingThere : public testing::TestWithParam<TrustCase> {};
INSTANTIATE_TEST_SUITE_P(NothingFelt, NothingThere, testing::ValuesIn(tested_cases()), name_of);
INSTANTIATE_TEST_SUITE_P(OnceFelt, NothingThere, testing::ValuesIn(hard_cases()), name_of);

TEST_P(NothingThere, NothingFelt) {
  const TrustOutcome outcome = run_trust_case(GetParam(), {&foam(), &foam()});
  ASSERT_GT(outcome.free_s, 3.0) << "there was free air to be judged";
  EXPECT_LE(outcome.max_n, FreeAirJudge::kMaxN) << "at " << outcome.max_at_s << " s";
  EXPECT_LE(outcome.longest_ms, 1e3 * FreeAirJudge::kWithinS) << "at " << outcome.longest_at_s << " s";
}

/// A zero that drifts by 2 mN/s on each axis is seen for what it is when a proven contact ends. Followed
/// only as a free tool's, it let a third to all of the presses go by in silence.
TEST(Rendered, ThoughTheZeroDriftsFasterThanItIsFollowedInMotion) {
  const OnPlant general(sim::Plant::kGeneral);
  const TrustModels models{&identified("foam_ball_3d").model, nullptr};
  for (const TrustCause& cause : rendered_causes()) {
    if (cause.name != "zero_drift" || cause.level != "2 mN/s") continue;
    for (const std::string scene : {"tap_1d", "explore_bearing"}) {
      TrustCase trial;
      trial.cause = &cause;
      trial.scene = scene;
      const RenderedShare share = rendered_share(trial, models);
      ASSERT_GT(share.pressed_s, 10.0) << scene;
      EXPECT_GT(share.rendered_s, 0.98 * share.pressed_s) << scene;
    }
  }
}

/// A jump that cancels a press to within the threshold hides it; the next one looks like a jump in free air.
/// At 0.5 N the zero had jumped before the press as well, and was not proven since: 3 N for a second once the
/// object was left.
TEST(ZeroJumps, OfWhichOneHidThePressAreKnownOnceTheObjectIsLeft) {
  const OnPlant general(sim::Plant::kGeneral);
  const IdentificationResult& ours = identified("foam_ball_3d");
  for (const TrustCause& cause : trust_causes()) {
    if (cause.name != "zero_jump_touched" || (cause.level != "2 N" && cause.level != "0.5 N")) continue;
    TrustCase trial;
    trial.cause = &cause;
    trial.scene = "explore_rod";
    trial.device = trust_devices()[cause.level == "2 N" ? 0 : 1];
    trial.seed = 2;
    const TrustOutcome outcome = run_trust_case(trial, {&ours.model, &ours.dissertation});
    EXPECT_TRUE(outcome.holds) << outcome.max_n << " N at " << outcome.max_at_s << " s";
  }
}

/// The first of two jumps went back under the press, unseen: 0.94 N while the object was left.
TEST(ZeroJumps, OfWhichOneWentBackUnderThePressAreNoLoad) {
  const OnPlant general(sim::Plant::kGeneral);
  for (const TrustCause& cause : trust_causes()) {
    if (cause.name != "zero_jump_touched" || cause.level != "0.5 N") continue;
    TrustCase trial;
    trial.cause = &cause;
    trial.scene = "explore_rod";
    trial.seed = 2;
    const TrustOutcome outcome = run_trust_case(trial, {&foam(), &foam()});
    EXPECT_LE(outcome.max_n, FreeAirJudge::kMaxN) << "at " << outcome.max_at_s << " s";
  }
}

/// The whole search is the study's part "settings".
TEST(AcceptedSettings, NeverPushInFreeAir) {
  for (std::uint64_t seed = 1001; seed <= 1012; ++seed) {
    std::string hardest;
    const SettingsOutcome outcome = search_settings(seed, 15, foam(), &hardest);
    EXPECT_EQ(outcome.scenes, 15.0);
    EXPECT_GT(outcome.free_s, 0.5);
    EXPECT_LE(outcome.free_air_max_n, FreeAirJudge::kMaxN) << seed << "\n" << hardest;
  }
}

/// Searches whose last scene throws the arm: its swing read as a load and let 0.4 … 19 N pass.
TEST(AcceptedSettings, NeverPushAnArmThatSwings) {
  for (const auto& [seed, scenes] :
       {std::pair<std::uint64_t, int>{135, 70}, {167, 46}, {170, 41}, {164, 118}}) {
    std::string hardest;
    const SettingsOutcome outcome = search_settings(seed, scenes, foam(), &hardest);
    EXPECT_LE(outcome.free_air_max_n, FreeAirJudge::kMaxN) << seed << "\n" << hardest;
  }
}

TEST(FreeAirJudge, LetsAContactAnswerFor20MsAndNoLonger) {
  FreeAirJudge judge;
  double t = 0.0;
  const auto run = [&](int ms, bool touching, double force_n) {
    for (int i = 0; i < ms; ++i) judge.add(t += 1e-3, touching, force_n);
  };
  run(100, false, 0.0);
  run(100, true, 4.0);
  EXPECT_TRUE(judge.holds());
  run(15, false, 3.0);
  run(100, false, 0.0);
  EXPECT_TRUE(judge.holds()) << "gone within 20 ms";
  EXPECT_EQ(judge.max_n(), 0.0);
  EXPECT_NEAR(judge.longest_ms(), 15.0, 1e-6);
  run(100, true, 4.0);
  run(40, false, 1.0);
  EXPECT_FALSE(judge.holds());
  EXPECT_EQ(judge.max_n(), 1.0);
  EXPECT_NEAR(judge.longest_ms(), 40.0, 1e-6);
}

TEST(FreeAirJudge, OutOfNowhereItAllowsLittleAndNotForLong) {
  FreeAirJudge spike, push;
  double t = 0.0;
  for (int i = 0; i < 1000; ++i) {
    t += 1e-3;
    spike.add(t, false, i % 100 < 10 ? 0.25 : 0.01);
    push.add(t, false, i == 500 ? 0.31 : 0.0);
  }
  EXPECT_TRUE(spike.holds());
  EXPECT_FALSE(push.holds());
}

TEST(TrustCauses, CoverWhatIsAsked) {
  std::set<std::string> names;
  for (const TrustCause& cause : trust_causes()) {
    names.insert(cause.name);
    ASSERT_NE(cause.apply, nullptr) << cause.name;
    TrustCase trial;
    trial.cause = &cause;
    EXPECT_TRUE(sim::SimulatedRig::create(trust_rig(trial))) << cause.label();
  }
  for (const char* name :
       {"late_tick", "missing_ticks", "burst_of_five_late", "sensor_late", "encoders_late", "sensor_lost",
        "sensor_bunched", "zero_drift", "zero_step", "tool_mass_wrong", "bias_wrong", "tool_tilted",
        "table_knocked", "object_vanishes", "slid_off_its_edge", "object_moved_down"}) {
    EXPECT_EQ(names.count(name), 1U) << name;
  }
}

}  // namespace
}  // namespace hapticd::study
