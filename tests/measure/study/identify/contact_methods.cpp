#include "tests/measure/study/identify/contact_methods.h"

#include "server/identification/estimate/contact/contact_creep_fit.h"
#include "server/identification/estimate/contact/contact_single_stage.h"
#include "server/identification/estimate/contact/contact_variable_projection.h"
#include "server/identification/gate/palpation_tracker.h"
#include "server/identification/session/contact/contact_identification.h"
#include "tests/measure/study/common/plant.h"
#include "tests/measure/study/common/scenes.h"
#include "tests/measure/study/common/simulated_session.h"
#include "tests/reference/contact_double_stage.h"

namespace hapticd::study {

namespace {

using Palpation = std::vector<identification::PalpationSample>;

constexpr double kSessionLimitS = 60.0;

}  // namespace

const ContactMethod& contact_reference() {
  static const ContactMethod method{"reference", kHuntCrossley, [](const Palpation& palpation) {
                                      const auto estimate = fit_with_ceres(palpation);
                                      return estimate ? FittedLaw{estimate->parameters, {}, {}}
                                                      : FittedLaw{{}, {}, estimate.error().text()};
                                    }};
  return method;
}

const std::vector<ContactMethod>& contact_methods() {
  static const std::vector<ContactMethod> all{
      {"recursive", kHuntCrossley,
       [](const Palpation& p) { return fit_recursively(identification::SingleStageEstimator(), p); }},
      {"double_stage", kHuntCrossley,
       [](const Palpation& p) { return fit_recursively(identification::DoubleStageEstimator(), p); }},
      {"batch", kHuntCrossley,
       [](const Palpation& palpation) {
         const auto estimate = identification::fit_by_variable_projection(palpation);
         return estimate ? FittedLaw{estimate->parameters, {}, {}} : FittedLaw{{}, {}, "not determined"};
       }},
      {"batch", kCreep, [](const Palpation& palpation) {
         identification::CreepFit fit(rt::CreepParameters{}.time_s);
         for (const identification::PalpationSample& s : palpation) fit.add(s, 1e-3);
         const auto estimate = fit.solve();
         return estimate ? FittedLaw{{}, estimate->law.parameters, {}} : FittedLaw{{}, {}, "not determined"};
       }}};
  return all;
}

ContactErrors errors_of(const FittedLaw& fitted, const TruePalpation& palpation) {
  return fitted.creep ? errors_of(*fitted.creep, palpation) : errors_of(*fitted.hunt_crossley, palpation);
}

TruePalpation requested_palpation(const std::string& object) {
  const sim::SimulationConfig config = explore_rig("phantom_1_5_high_force", object, "rod");
  const auto rig = create_rig(config);
  const hal::RigInfo info = (*rig)->info();
  identification::ContactIdentification identification(identification::ContactTask{}, info);
  identification::PalpationTracker tracker(info.sensor.tool_mass_g, 0.02, info.device.position_resolution_mm,
                                           info.rate_hz);
  TruePalpation palpation;
  run_session(identification, config, kSessionLimitS,
              [&](const rt::Observation& o, const hal::TruthSample& truth) {
                palpation.samples.push_back(tracker.update(o.sample));
                palpation.true_displacement_mm.push_back(truth.displacement_mm);
              });
  return palpation;
}

}  // namespace hapticd::study
