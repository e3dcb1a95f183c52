// The guard alone keeps free air free: pipelines that want the worst, on the simulated rig.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "rt/scene/renderer.h"
#include "rt/scene/scene_spec.h"
#include "tests/measure/study/common/scenes.h"
#include "tests/support/free_air_judge.h"
#include "tests/support/value_of.h"

namespace hapticd::study {
namespace {

using sim::HandProgram;

enum class Wants { kConstant, kLastForce, kIntegral };

/// Knows no contact, no law and no gain.
class WorstPipeline final : public rt::Pipeline {
 public:
  explicit WorstPipeline(Wants wants) : wants_(wants) {}
  std::uint32_t channels() const noexcept override { return rt::channel::kZero; }
  rt::PipelineOutput evaluate(const hal::RigSample& sample) noexcept override {
    constexpr double kMostN = 8.0;
    const double reading_n = sample.sensor_force_n.z;
    switch (wants_) {
      case Wants::kConstant:
        force_n_ = kMostN;
        break;
      case Wants::kLastForce:
        force_n_ = std::max(force_n_, 2.0 * reading_n);
        break;
      case Wants::kIntegral:
        force_n_ += 0.02 * reading_n;
        break;
    }
    force_n_ = std::clamp(force_n_, -kMostN, kMostN);
    return {{0.0, 0.0, force_n_}, true, true, 0};
  }
  void fill_record(rt::TickRecord&) const noexcept override {}
  void applied(const hal::Vector3&) noexcept override {}
  void reset() noexcept override {}
  void set_target(const rt::TargetLaw&, double) noexcept override {}

 private:
  Wants wants_;
  double force_n_ = 0.0;
};

struct Condition {
  const char* name;
  double value;
};

struct Trial {
  Wants wants;
  HandProgram::Kind hand;
  std::vector<Condition> conditions;
  double rate_hz = 1000.0;
};

test::FreeAirJudge judged(const Trial& trial, double seconds) {
  sim::SimulationConfig config = explore_rig("phantom_1_0", "rubber_ball", "rod");
  config.rate_hz = trial.rate_hz;
  for (const Condition& condition : trial.conditions) config.condition_values[condition.name] = condition.value;
  const auto rig = test::value_of(sim::SimulatedRig::create(config));
  HandProgram hand;
  hand.kind = trial.hand;
  hand.repetitions = -1;
  if (trial.hand == HandProgram::Kind::kSway) {
    hand.place_mm = {0.0, 0.0, 60.0};
    hand.rate_hz = 2.2;
    hand.speed_mm_per_s = 276.0;
    hand.hold_s = -1.0;
  }
  if (trial.hand == HandProgram::Kind::kDart) hand.place_mm = {0.0, 0.0, 80.0};
  test::demand(rig->set_program(hand));
  rt::SceneSpec scene;
  scene.name = "worst";
  scene.tool_mass_g = kExploreToolMassG;
  scene.guard.max_power_w = 100.0;
  const rt::SceneSpec resolved = test::value_of(rt::resolve(scene, rig->info()));
  WorstPipeline pipeline(trial.wants);
  rt::Renderer renderer(resolved.guard, trial.rate_hz);
  renderer.exchange(&pipeline, resolved.guard);
  test::FreeAirJudge judge;
  hal::RigSample sample;
  hal::TruthSample truth;
  for (double now_s = 0.0; now_s < seconds;) {
    rig->read(sample);
    rig->truth(truth);
    rt::TickRecord record;
    rig->write(renderer.tick(sample, record));
    now_s = 1e-9 * static_cast<double>(sample.time_ns);
    judge.add(now_s, truth.in_contact, std::sqrt(dot(record.device_command_n, record.device_command_n)));
    if (record.guard_state == rt::GuardState::kLatched) renderer.clear();
  }
  renderer.exchange(nullptr, resolved.guard);
  return judge;
}

/// A tool that touches nothing. What the guard alone does not hold is said in docs/trust.md: after such a
/// pipeline has pushed with 8 N in a contact, the tool swings, and so it does where the force alternates; with
/// a zero that drifts and a mass that is wrong, too, the swing is taken for a load.
TEST(WorstPipeline, HasThreeTenthsOfANewtonWhereNothingIsTouched) {
  using Kind = HandProgram::Kind;
  const std::vector<std::vector<Condition>> conditions{
      {},
      {{"bias_error_z_n", 0.3}},
      {{"tool_tilt_deg", 60.0}, {"tool_tilt_at_s", 2.0}},
      {{"sensor_step_n", 1.0}, {"sensor_step_interval_s", 0.97}},
  };
  for (const Wants wants : {Wants::kConstant, Wants::kLastForce, Wants::kIntegral}) {
    for (const Kind hand : {Kind::kRest, Kind::kSway, Kind::kDart}) {
      for (std::size_t i = 0; i < conditions.size(); ++i) {
        const test::FreeAirJudge judge = judged({wants, hand, conditions[i]}, 6.0);
        EXPECT_LE(judge.max_n(), test::FreeAirJudge::kMaxN + 1e-9)
            << "wants " << static_cast<int>(wants) << ", hand " << static_cast<int>(hand) << ", conditions " << i
            << ", at " << judge.max_at_s() << " s";
        EXPECT_GT(judge.free_s(), 0.2);
      }
    }
  }
}

}  // namespace
}  // namespace hapticd::study
