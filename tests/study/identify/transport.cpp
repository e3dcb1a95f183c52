#include <cmath>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "rt/identify/contact_identification.h"
#include "rt/identify/friction_identification.h"
#include "rt/identify/press_frame.h"
#include "rt/identify/threshold_identification.h"
#include "rt/identify/tool_identification.h"
#include "rt/signal/vector.h"
#include "server/palpation/simulated_palpator.h"
#include "tests/emulated_rig/emulated_rig.h"
#include "tests/study/explore/scenes.h"
#include "tests/study/identify/contact_palpation.h"
#include "tests/study/identify/friction_validation.h"
#include "tests/study/identify/identify_study.h"
#include "tests/study/identify/simulated_session.h"
#include "tests/study/plant.h"
#include "tests/support/value_of.h"

namespace hapticd::study {

namespace {

using report::fixed;
using report::significant;

constexpr const char* kDevice = "phantom_1_5_high_force";
constexpr double kLimitS = 90.0;
constexpr double kStrokeMm = 50.0;
constexpr double kDriftNPerS = 1e-3;

/// Half a millisecond twice a second, 5 ms every three seconds.
std::vector<double> late_ticks_us() {
  std::vector<double> late(6'000, 0.0);
  for (std::size_t i = 499; i < late.size(); i += 500) late[i] = 500.0;
  for (std::size_t i = 2'999; i < late.size(); i += 3'000) late[i] = 5'000.0;
  for (std::size_t i = 1; i < late.size(); ++i) late[i] = std::max(late[i], late[i - 1] - 1'000.0);
  return late;
}

/// Live, over the vendor's library and the Net F/T box, with a late scheduler and a drifting sensor: the
/// simulated hand does what is wished for, and the device gives no force.
SessionResult run_emulated(rt::Identification& identification, bool is_press,
                           const sim::SimulationConfig& simulation) {
  test::EmulatedRigConfig config;
  config.simulation = simulation;
  config.simulation.condition_values["sensor_drift_n_per_s"] = kDriftNPerS;
  config.scene.name = "far_wall";
  config.scene.kind = rt::SceneKind::kWall;
  config.scene.wall_position_mm = 500.0;
  config.scene.target = rt::linear_target(0.5);
  config.scene.guard.sensor_stale_after_ms = 0.0;
  config.stall_s = 2.0;
  test::EmulatedRig rig(config);
  rig.page().set_late_ticks(late_ticks_us());

  const double mass_g = simulation.tool_mass_g;
  rt::PressFrame frame({}, rt::ToolLoad(mass_g, {0.0, 0.0, -1.0}), mass_g, rig.rig().info());
  rt::Engine& engine = rig.engine();
  engine.observe(true);
  SessionResult result;
  double next_wish_s = 0.0;
  int idle_wishes = 0;
  std::int64_t began_ns = -1;
  rt::Observation observation;
  for (bool over = false; !over;) {
    while (result.duration_s < next_wish_s && engine.pop_observation(observation)) {
      if (began_ns < 0) began_ns = observation.sample.time_ns;
      result.duration_s = 1e-9 * static_cast<double>(observation.sample.time_ns - began_ns);
      if (is_press) frame.follow_zero(observation.sample);
      identification.add(is_press ? frame.upright(observation) : observation);
    }
    if (result.duration_s < next_wish_s) {
      rig.pass(1e-3);
      continue;
    }
    result.progress = identification.progress();
    if (result.progress.converged) result.converged_s = result.duration_s;
    const rt::Wish wish = identification.wish();
    const bool idle = wish.motion == rt::Wish::Motion::kRest && wish.hold_s <= 0.0;
    idle_wishes = idle ? idle_wishes + 1 : 0;
    over = result.progress.converged || result.duration_s >= kLimitS || idle_wishes >= 2;
    const server::SimulatedMotion motion = server::simulated_motion(wish);
    rig.set_hand(motion.program);
    next_wish_s = result.duration_s + motion.duration_s;
  }
  engine.observe(false);
  return result;
}

/// What is identified, and how wrong a model of it is.
struct Kind {
  std::string name;
  std::string object;
  bool is_press;
  sim::SimulationConfig simulation;
  std::function<std::unique_ptr<rt::Identification>(const hal::RigInfo&)> make;
  std::function<double(const rt::IdentifiedModel&)> error;
  std::string measure;
};

Kind contact_of(const std::string& object) {
  return {"contact",
          object,
          true,
          explore_rig(kDevice, object, "ball_bearing"),
          [](const hal::RigInfo& rig) {
            return std::make_unique<rt::ContactIdentification>(rt::ContactTask{}, rig);
          },
          [object](const rt::IdentifiedModel& model) {
            const auto& contact = std::get<rt::ContactModel>(model.content);
            const TruePalpation truth = palpate(object, validation_wishes(), 7);
            if (contact.creep) return errors_of(contact.creep->parameters, truth).force;
            return errors_of(contact.hunt_crossley->parameters, truth).force;
          },
          "mean error of the force on other presses"};
}

Kind friction_of(const std::string& object) {
  return {"friction",
          object,
          true,
          explore_rig(kDevice, object, "rod"),
          [](const hal::RigInfo& rig) {
            return std::make_unique<rt::FrictionIdentification>(rt::FrictionTask{}, rig);
          },
          [object](const rt::IdentifiedModel& model) {
            return judge_friction(validation_strokes(object, "rod", kStrokeMm),
                                  std::get<rt::FrictionModel>(model.content).friction)
                .error;
          },
          "mean error of the friction on other strokes"};
}

Kind tool() {
  sim::SimulationConfig simulation;
  simulation.device = kDevice;
  simulation.object = "none";
  return {
      "tool",
      "none",
      false,
      simulation,
      [](const hal::RigInfo& rig) { return std::make_unique<rt::ToolIdentification>(rt::ToolTask{}, rig); },
      [mass_g = simulation.tool_mass_g](const rt::IdentifiedModel& model) {
        return std::abs(std::get<rt::ToolModel>(model.content).mass_g / mass_g - 1.0);
      },
      "error of the mass"};
}

void compare(StudyContext& context, const Kind& kind, report::MarkdownTable& table) {
  const hal::RigInfo info = test::value_of(create_rig(kind.simulation))->info();
  for (const std::string transport : {"direct", "emulated"}) {
    const auto identification = kind.make(info);
    const report::Case conditions{{"kind", kind.name}, {"object", kind.object}, {"transport", transport}};
    report::Figure error{"identified_error", conditions};
    error.source = kind.measure;
    report::Figure converged{"identified_after_s", conditions};
    converged.unit = "s";
    const SessionResult session = transport == "direct"
                                      ? run_session(*identification, kind.simulation, kLimitS)
                                      : run_emulated(*identification, kind.is_press, kind.simulation);
    const auto model = identification->finish();
    if (model) {
      error.value = kind.error(*model);
    } else {
      error.failed = model.error().text();
    }
    if (session.converged_s >= 0.0) {
      converged.value = session.converged_s;
    } else {
      converged.failed = "not within " + fixed(kLimitS, 0) + " s";
    }
    context.report.add(error);
    context.report.add(converged);
    table.add_row({kind.name, kind.object, transport,
                   error.value ? fixed(100.0 * *error.value, 2) + " %" : error.failed,
                   converged.value ? fixed(*converged.value, 1) : converged.failed,
                   std::to_string(session.progress.samples), kind.measure});
  }
}

}  // namespace

void run_identify_transport(StudyContext& context) {
  std::vector<Kind> kinds{contact_of("sponge_cut"), contact_of("rubber_ball_3d"), tool(),
                          friction_of("rubber_ball_3d")};
  if (context.quick) kinds.pop_back();
  report::MarkdownTable table(
      {"kind", "object", "transport", "error", "converged after s", "samples", "error of what"});
  for (const Kind& kind : kinds) compare(context, kind, table);
  context.report.add_table("identify_transport", "Identification over both transports", table,
                           "On the direct simulated rig in virtual time, and live over the vendor's "
                           "library and the Net F/T box with late ticks and a sensor that drifts by 1 mN/s.");
}

}  // namespace hapticd::study
