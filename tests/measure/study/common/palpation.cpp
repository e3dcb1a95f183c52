#include "tests/measure/study/common/palpation.h"

#include <filesystem>
#include <fstream>
#include <optional>
#include <sstream>
#include <string>

#include "server/identification/session/contact/contact_identification.h"
#include "server/identification/session/friction_identification.h"
#include "server/model/model_file.h"
#include "tests/measure/report/markdown_table.h"
#include "tests/measure/study/common/plant.h"
#include "tests/measure/study/common/scenes.h"
#include "tests/measure/study/common/simulated_session.h"
#include "tests/support/value_of.h"

namespace hapticd::study {

namespace {

using report::fixed;
using test::value_of;

constexpr double kContactLimitS = 120.0;
constexpr double kFrictionLimitS = 90.0;
constexpr double kDeepForceN = 12.0;      // what a firm hand reaches
constexpr double kPublishedForceN = 6.0;  // D Fig. 4.12

/// Identifies as the service does: what the identification asks for, and what it makes of it.
template <class Identification, class Task>
rt::IdentifiedModel by_session(const Task& task, const std::string& object, double limit_s) {
  const sim::SimulationConfig config = explore_rig("phantom_1_5_high_force", object, "rod");
  Identification identification(task, value_of(create_rig(config))->info());
  run_session(identification, config, limit_s);
  return value_of(identification.finish());
}

rt::IdentifiedModel pressed(const std::string& object, double force_n,
                            std::optional<rt::ContactLawKind> law = std::nullopt) {
  identification::ContactTask task;
  task.force_n = force_n;
  task.law = law;
  return by_session<identification::ContactIdentification>(task, object, kContactLimitS);
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

IdentificationResult identify(const std::string& object) {
  IdentificationResult result;
  result.contact = pressed(object, kDeepForceN);
  result.friction = by_session<identification::FrictionIdentification>(identification::FrictionTask{}, object,
                                                                       kFrictionLimitS);
  const auto& laws = std::get<rt::ContactModel>(result.contact.content);
  rt::ObjectModel& model = result.model;
  model.name = object;
  model.identified_on =
      "sim:phantom_1_5_high_force, identify contact up to " + fixed(kDeepForceN, 0) + " N, identify friction";
  if (current_plant() != sim::Plant::kSeparable) {
    model.identified_on += std::string(", plant ") + sim::name_of(current_plant());
  }
  if (!laws.hunt_crossley) model.identified_on += without_power_law(result.contact);
  model.max_displacement_mm = result.contact.validity.max_displacement_mm;
  model.max_force_n = result.contact.validity.max_force_n;
  model.hunt_crossley = laws.hunt_crossley;
  model.creep = laws.creep;
  model.rod_friction = rt::rendered_friction(result.friction);

  result.dissertation.name = object;
  result.dissertation.hunt_crossley =
      std::get<rt::ContactModel>(pressed(object, kPublishedForceN, rt::ContactLawKind::kHuntCrossley).content)
          .hunt_crossley;
  result.dissertation.rod_friction = model.rod_friction;
  return result;
}

rt::ObjectModel shipped_model(const std::string& object) {
  const std::filesystem::path path = std::filesystem::path(HAPTICD_MODELS) / (object + ".toml");
  std::stringstream text;
  text << std::ifstream(path).rdbuf();
  return value_of(server::parse_model(text.str(), path.string()));
}

}  // namespace hapticd::study
