#include "tests/measure/study/identify/shipped_models.h"

#include <filesystem>
#include <fstream>
#include <optional>
#include <stdexcept>
#include <string>

#include "server/identification/session/contact/contact_identification.h"
#include "server/identification/session/friction_identification.h"
#include "server/model/model_file.h"
#include "tests/measure/study/common/plant.h"
#include "tests/measure/study/common/scenes.h"
#include "tests/measure/study/identify/identify_study.h"
#include "tests/measure/study/identify/simulated_session.h"
#include "tests/support/value_of.h"

namespace hapticd::study {

namespace {

using report::fixed;
using test::value_of;

constexpr double kContactLimitS = 120.0;
constexpr double kFrictionLimitS = 90.0;
constexpr double kDeepForceN = 12.0;  // what a firm hand reaches

/// As the service does it: what the identification asks for, and what it makes of it.
template <class Identification, class Task>
rt::IdentifiedModel identified(const Task& task, const std::string& object, double limit_s) {
  const sim::SimulationConfig config = explore_rig("phantom_1_5_high_force", object, "rod");
  Identification identification(task, value_of(create_rig(config))->info());
  run_session(identification, config, limit_s);
  return value_of(identification.finish());
}

std::string without_power_law(const rt::IdentifiedModel& contact) {
  for (const rt::EstimatedParameter& p : contact.parameters) {
    if (p.name != "held_out_power") continue;
    return "; no Hunt-Crossley law: it misses displacement held out of the fit by " +
           fixed(100.0 * p.value, 0) + " %, more than a hand can feel";
  }
  return "; no Hunt-Crossley law: it could not be fitted";
}

}  // namespace

ShippedModel identify_to_ship(const std::string& object) {
  identification::ContactTask press;
  press.force_n = kDeepForceN;
  ShippedModel shipped;
  shipped.contact = identified<identification::ContactIdentification>(press, object, kContactLimitS);
  shipped.friction = identified<identification::FrictionIdentification>(identification::FrictionTask{},
                                                                        object, kFrictionLimitS);
  const auto& laws = std::get<rt::ContactModel>(shipped.contact.content);
  rt::ObjectModel& model = shipped.model;
  model.name = object;
  model.identified_on =
      "sim:phantom_1_5_high_force, identify contact up to " + fixed(kDeepForceN, 0) + " N, identify friction";
  if (!laws.hunt_crossley) model.identified_on += without_power_law(shipped.contact);
  model.max_displacement_mm = shipped.contact.validity.max_displacement_mm;
  model.max_force_n = shipped.contact.validity.max_force_n;
  model.hunt_crossley = laws.hunt_crossley;
  model.creep = laws.creep;
  model.rod_friction = std::get<rt::FrictionModel>(shipped.friction.content).friction;
  return shipped;
}

void run_identify_shipped_models(StudyContext& context) {
  report::MarkdownTable table({"object", "Hunt-Crossley error %", "creep error %", "known to mm", "μ_k",
                               "δ mm", "exponent", "converged", "contact procedure"});
  const std::filesystem::path folder = context.report.folder() / "shipped_models";
  std::filesystem::create_directories(folder);
  for (const std::string& object : explored_objects()) {
    const auto [model, contact, friction] = identify_to_ship(object);
    const auto add = [&, &contact = contact](const char* law, std::optional<double> error) {
      report::Figure figure{"shipped_model_displacement_error", {{"object", object}, {"law", law}}};
      figure.source = "rms over the palpation itself";
      figure.value = error;
      if (!error) figure.failed = "left out: " + contact.procedure;
      context.report.add(figure);
      return error ? fixed(100.0 * *error, 1) : std::string(report::kNoNumber);
    };
    const auto error_of = [](const auto& law) {
      return law ? std::optional(law->relative_error) : std::nullopt;
    };
    table.add_row({object, add("hunt_crossley", error_of(model.hunt_crossley)),
                   add("creep", error_of(model.creep)), fixed(model.max_displacement_mm, 1),
                   fixed(model.rod_friction->kinetic, 3), fixed(model.rod_friction->presliding_mm, 3),
                   fixed(model.rod_friction->exponent, 2),
                   std::string(contact.converged ? "contact " : "") + (friction.converged ? "friction" : ""),
                   contact.procedure + " / " + friction.procedure});
    std::ofstream file(folder / (object + ".toml"));
    file << server::write_model(model);
    if (!file.flush()) throw std::runtime_error("cannot write " + (folder / (object + ".toml")).string());
  }
  context.report.add_table("shipped_models", "Models as the service's own identification makes them", table,
                           "Files: shipped_models/*.toml, those of server/model/shipped.");
}

}  // namespace hapticd::study
