#include <algorithm>
#include <cmath>
#include <exception>
#include <functional>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#include "server/identification/session/contact/contact_identification.h"
#include "server/identification/session/friction_identification.h"
#include "server/identification/session/gains_identification.h"
#include "server/identification/session/structural_identification.h"
#include "server/identification/session/threshold_identification.h"
#include "server/identification/session/tool_identification.h"
#include "tests/emulated_rig/board_rig.h"
#include "tests/emulated_rig/emulated_rig.h"
#include "tests/emulated_rig/identify_run.h"
#include "tests/measure/study/common/parts.h"
#include "tests/measure/study/common/plant.h"
#include "tests/measure/study/common/scenes.h"
#include "tests/measure/study/common/simulated_session.h"
#include "tests/measure/study/identify/contact_palpation.h"
#include "tests/measure/study/identify/friction_validation.h"
#include "tests/support/value_of.h"

namespace hapticd::study {

namespace {

using report::fixed;
using report::significant;

constexpr const char* kDevice = "phantom_1_5_high_force";
constexpr const char* kLightDevice = "phantom_1_0";
constexpr double kStrokeMm = 50.0;
constexpr double kInstrumentMmPerV = 25.0;

/// How the rig is reached. Direct and over the board in virtual time, the others live.
std::vector<std::string> transports_of(const std::string& kind, bool quick) {
  if (!quick) return {"direct", "emulated", "mixed", "board"};
  if (kind == "contact" || kind == "tool") return {"direct", "emulated", "board"};
  return {"direct", "board"};
}

/// What is identified, and how wrong a model of it is.
struct Kind {
  std::string name;
  std::string object;
  test::SeenAs seen_as;
  sim::SimulationConfig simulation;
  std::function<std::unique_ptr<identification::Identification>(const hal::RigInfo&)> make;
  std::function<double(const rt::IdentifiedModel&)> error;
  std::string measure;
  std::vector<std::string> parameters;  ///< that are shown
  double limit_s = 90.0;
};

/// What was found, "name value ± error; …".
std::string found_text(const Kind& kind, const rt::IdentifiedModel& model) {
  std::string text;
  for (const rt::EstimatedParameter& p : model.parameters) {
    if (std::find(kind.parameters.begin(), kind.parameters.end(), p.name) == kind.parameters.end()) continue;
    text += (text.empty() ? "" : "; ") + p.name + " " + significant(p.value, 4);
    if (std::isfinite(p.standard_error)) text += " ± " + significant(p.standard_error, 2);
  }
  return text.empty() ? report::kNoNumber : text;
}

Kind contact_of(const std::string& object) {
  return {"contact",
          object,
          test::SeenAs::kUpright,
          explore_rig(kDevice, object, "ball_bearing"),
          [](const hal::RigInfo& rig) {
            return std::make_unique<identification::ContactIdentification>(identification::ContactTask{},
                                                                           rig);
          },
          [object](const rt::IdentifiedModel& model) {
            const auto& contact = std::get<rt::ContactModel>(model.content);
            const TruePalpation truth = palpate(object, validation_requests(), 7);
            if (contact.creep) return errors_of(contact.creep->parameters, truth).force;
            return errors_of(contact.hunt_crossley->parameters, truth).force;
          },
          "mean error of the force on other presses",
          {"displacement_mm", "stiffness_n_per_mm_m", "exponent"}};
}

Kind friction_of(const std::string& object) {
  return {"friction",
          object,
          test::SeenAs::kUpright,
          explore_rig(kDevice, object, "rod"),
          [](const hal::RigInfo& rig) {
            return std::make_unique<identification::FrictionIdentification>(identification::FrictionTask{},
                                                                            rig);
          },
          [object](const rt::IdentifiedModel& model) {
            return judge_friction(validation_strokes(object, "rod", kStrokeMm),
                                  std::get<rt::FrictionModel>(model.content).friction)
                .error;
          },
          "mean error of the friction on other strokes",
          {"kinetic", "presliding_mm"}};
}

Kind tool() {
  sim::SimulationConfig simulation;
  simulation.device = kDevice;
  simulation.object = "none";
  return {"tool",
          "none",
          test::SeenAs::kRaw,
          simulation,
          [](const hal::RigInfo& rig) {
            return std::make_unique<identification::ToolIdentification>(identification::ToolTask{}, rig);
          },
          [mass_g = simulation.tool_mass_g](const rt::IdentifiedModel& model) {
            return std::abs(std::get<rt::ToolModel>(model.content).mass_g / mass_g - 1.0);
          },
          "error of the mass",
          {"mass_g"}};
}

/// Ratio by which other free motion, on the direct rig, exceeds it.
Kind threshold(bool quick) {
  sim::SimulationConfig simulation;
  simulation.device = kLightDevice;
  simulation.object = "none";
  return {"threshold",
          "none",
          test::SeenAs::kSeated,
          simulation,
          [quick](const hal::RigInfo& rig) {
            return std::make_unique<identification::ThresholdIdentification>(
                identification::ThresholdTask{.duration_s = quick ? 10.0 : 20.0}, rig);
          },
          [simulation](const rt::IdentifiedModel& model) {
            sim::SimulationConfig other = simulation;
            other.seed += 1000;
            identification::ThresholdIdentification watched({.duration_s = 30.0},
                                                            test::value_of(create_rig(other))->info());
            run_session(watched, other, 60.0);
            const auto seen = test::value_of(watched.finish());
            const double largest_n = std::get<rt::ThresholdModel>(seen.content).largest_residual_n;
            return std::max(0.0, largest_n / std::get<rt::ThresholdModel>(model.content).threshold_n - 1.0);
          },
          "excess of the largest residual of other free motion",
          {"threshold_n", "largest_residual_n"},
          quick ? 90.0 : 180.0};
}

Kind gains(double target_n_per_mm, double amplifier_pole_hz) {
  sim::SimulationConfig simulation;
  simulation.device = kLightDevice;
  simulation.object = "sponge_block";
  simulation.amplifier_pole_hz = amplifier_pole_hz;
  const auto make = [target_n_per_mm](const hal::RigInfo& rig) {
    return std::make_unique<identification::GainsIdentification>(
        identification::GainsTask{.target_stiffness_n_per_mm = target_n_per_mm}, rig);
  };
  return {"gains",
          "sponge_block, amplifier of " + fixed(amplifier_pole_hz, 0) + " Hz",
          test::SeenAs::kRaw,
          simulation,
          make,
          [simulation, make](const rt::IdentifiedModel& model) {
            sim::SimulationConfig other = simulation;
            other.seed += 1000;
            const auto again = make(test::value_of(create_rig(other))->info());
            run_session(*again, other, 240.0);
            const auto seen = test::value_of(again->finish());
            return std::abs(std::get<rt::GainsModel>(model.content).proportional_gain /
                                std::get<rt::GainsModel>(seen.content).proportional_gain -
                            1.0);
          },
          "difference of Kp from a search on the direct rig with other noise",
          {"ultimate_gain", "ultimate_period_ms", "proportional_gain"},
          240.0};
}

Kind structural(bool rigid) {
  sim::SimulationConfig simulation;
  simulation.device = kLightDevice;
  simulation.object = rigid ? "wood_plate" : "none";
  const double truth = test::value_of(create_rig(simulation))->info().device.structural_stiffness_n_per_mm;
  identification::StructuralStiffnessTask task;
  task.constant = true;
  task.rigid_contact = rigid;
  return {rigid ? "structural, rigid contact" : "structural, instrument",
          simulation.object,
          test::SeenAs::kRaw,
          simulation,
          [task](const hal::RigInfo& rig) {
            return std::make_unique<identification::StructuralIdentification>(task, rig);
          },
          [truth](const rt::IdentifiedModel& model) {
            return std::abs(std::get<rt::StructuralModel>(model.content).stiffness_n_per_mm / truth - 1.0);
          },
          "error of the stiffness",
          {"structural_stiffness_n_per_mm"},
          120.0};
}

/// What an identification over one of the transports came to.
struct Outcome {
  std::unique_ptr<identification::Identification> identification;
  SessionResult session;
};

Outcome run_over(const std::string& transport, const Kind& kind) {
  Outcome outcome;
  if (transport == "direct") {
    outcome.identification = kind.make(test::value_of(create_rig(kind.simulation))->info());
    outcome.session = run_session(*outcome.identification, kind.simulation, kind.limit_s);
    return outcome;
  }
  test::RunConfig common = test::rig_for_identification(kind.simulation);
  common.instrument_mm_per_v = kInstrumentMmPerV;
  std::unique_ptr<test::Run> run;
  if (transport == "board") {
    run = std::make_unique<test::BoardRig>(common);
  } else {
    test::EmulatedRigConfig config;
    static_cast<test::RunConfig&>(config) = common;
    config.sensor_on_board = transport == "mixed";
    config.stall_s = 2.0;
    run = std::make_unique<test::EmulatedRig>(config);
  }
  outcome.identification = kind.make(run->rig_info());
  const test::IdentifyRunResult found = test::identify_on(
      *run, *outcome.identification, {kind.seen_as, {}, kind.simulation.tool_mass_g, kind.limit_s});
  outcome.session.duration_s = found.duration_s;
  outcome.session.converged_s = found.converged_s;
  outcome.session.progress = found.progress;
  if (found.latched != rt::GuardFault::kNone) {
    throw std::runtime_error("the guard latched: " + std::string(rt::rule_of(found.latched).name));
  }
  return outcome;
}

void compare(StudyContext& context, const Kind& kind, report::MarkdownTable& table) {
  for (const std::string& transport : transports_of(kind.name, context.quick)) {
    const report::Case conditions{{"kind", kind.name}, {"object", kind.object}, {"transport", transport}};
    report::Figure error{"identified_error", conditions};
    error.source = kind.measure;
    report::Figure converged{"identified_after_s", conditions};
    converged.unit = "s";
    std::string found = report::kNoNumber;
    SessionResult session;
    try {
      const Outcome outcome = run_over(transport, kind);
      session = outcome.session;
      if (const auto model = outcome.identification->finish()) {
        error.value = kind.error(*model);
        found = found_text(kind, *model);
      } else {
        error.failed = model.error().text();
      }
    } catch (const std::exception& problem) {
      error.failed = problem.what();
    }
    if (session.converged_s >= 0.0) {
      converged.value = session.converged_s;
    } else {
      converged.failed = "not within " + fixed(kind.limit_s, 0) + " s";
    }
    context.report.add(error);
    context.report.add(converged);
    const std::string shown = error.value ? fixed(100.0 * *error.value, 2) + " %" : error.failed;
    report::Report::note(kind.name + ", " + kind.object + ", " + transport + ": " + shown);
    table.add_row({kind.name, kind.object, transport, found, shown,
                   converged.value ? fixed(*converged.value, 1) : converged.failed,
                   std::to_string(session.progress.samples), kind.measure});
  }
}

}  // namespace

void run_identify_transport(StudyContext& context) {
  std::vector<Kind> kinds{contact_of("sponge_cut"), tool(),
                          threshold(context.quick), gains(1.0, 300.0),
                          structural(false),        structural(true)};
  if (!context.quick) {
    kinds.push_back(contact_of("rubber_ball_3d"));
    kinds.push_back(friction_of("rubber_ball_3d"));
    kinds.push_back(gains(1.2, 20.0));
  }
  report::MarkdownTable table(
      {"kind", "object", "transport", "found", "error", "converged after s", "samples", "error of what"});
  for (const Kind& kind : kinds) compare(context, kind, table);
  context.report.add_table(
      "identify_transport", "Every kind of identification over every transport", table,
      "Direct: the simulated rig in virtual time. Emulated: live, the vendor's library and the Net F/T box. "
      "Mixed: live, the vendor's library and a sensor on an analog board. Board: encoders, motors and gauges "
      "of an analog board, in virtual time. The instrument is on the board in all of them but the first. All "
      "but the first with late ticks (0.5 ms twice a second, 5 ms every three seconds) and a sensor that "
      "drifts by 1 mN/s.");
}

}  // namespace hapticd::study
