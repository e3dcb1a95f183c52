#include "tests/measure/study/common/explore_study.h"
#include "tests/measure/study/common/rig_study.h"
#include "tests/measure/study/common/scenes.h"
#include "tests/measure/study/loading/loading_study.h"

namespace hapticd::study {

namespace {
constexpr double kMinForceN = 0.5;
constexpr double kLessForce = 0.8;  // so that little is given away
}  // namespace

LoadingTrial LoadingCase::trial(double rate_n_per_s) const {
  LoadingTrial trial = dims == 1 ? tap_loading(device, object, target_n_per_mm)
                                 : explore_loading(device, object, target_n_per_mm, identified(object).model);
  // Each device is pressed with a force that is some twenty to thirty times its own dry friction.
  trial.force_n = device == "phantom_1_0" ? 2.0 : 4.0;
  trial.rate_n_per_s = rate_n_per_s;
  return trial;
}

std::vector<LoadingCase> loading_cases(bool quick) {
  std::vector<LoadingCase> all;
  for (const std::string& device : sim::device_preset_names()) {
    for (const int dims : {1, 3}) {
      for (const std::string& object : dims == 1 ? tapped_objects() : explored_objects()) {
        if (quick && object != "sponge_block" && object != "rubber_ball_3d") continue;
        // Granted on each of them.
        for (const double target : {0.3, 0.7}) all.push_back({device, object, dims, target});
      }
    }
  }
  return all;
}

void leave_uncompensated(rt::SceneSpec& scene) {
  scene.compensation = {.lead_ms = 0.0, .reaction_lead_share = 0.0, .back_drive = false};
}

LoadingOutcome press_as_feasible(LoadingTrial& trial) {
  LoadingOutcome outcome = press(trial);
  while (!outcome.failed.empty() && kLessForce * trial.force_n >= kMinForceN) {
    trial.force_n *= kLessForce;
    outcome = press(trial);
  }
  return outcome;
}

}  // namespace hapticd::study
