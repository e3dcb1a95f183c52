#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "hal/samples.h"
#include "rt/model/models.h"
#include "rt/record/tick_record.h"
#include "rt/scene/pipeline.h"
#include "rt/scene/renderer.h"
#include "rt/scene/scene_spec.h"
#include "tests/measure/study/trust/trust_cause.h"

namespace hapticd::study {

/// The models that the explore scenes are loaded with; null if a scene needs none.
struct TrustModels {
  const rt::ObjectModel* ours = nullptr;
  const rt::ObjectModel* published = nullptr;  ///< what the dissertation's procedure gives
};

/// One run: a scene on a rig under one cause.
struct TrustCase {
  const TrustCause* cause = nullptr;
  std::string scene = "tap_1d";  ///< tap_1d, explore_rod, explore_bearing, wall
  std::string device = "phantom_1_0";
  double rate_hz = 1000.0;
  std::uint64_t seed = 1;
  bool published = false;    ///< the dissertation's pipeline in place of ours
  double duration_s = 16.0;  ///< a cause may ask for more

  std::string text() const;  ///< one line that names the case, enough to run it again
};

std::vector<std::string> trust_scenes();
std::vector<std::string> trust_devices();

/// What was seen where, by the truth, nothing was touched.
struct TrustOutcome {
  double simulated_s = 0.0;
  double free_s = 0.0;
  double max_n = 0.0;  ///< largest force later than 20 ms after a contact
  double max_at_s = 0.0;
  double longest_ms = 0.0;  ///< longest stretch at 0.05 N or more; after a contact, from its end
  double longest_at_s = 0.0;
  double declared = 0.0;      ///< contacts declared that were none
  double withdrawn = 0.0;     ///< contacts the scene took back
  double silent_share = 0.0;  ///< of the time in free air the guard gave no force, whatever was asked
  bool holds = true;
};

/// A program of the hand and when it takes over.
struct Act {
  double from_s = 0.0;
  sim::HandProgram program;
};

/// The closed loop of a case in virtual time. What latches is cleared after 0.3 s, as by a user: a device
/// that never renders again would prove nothing.
class TrustRun {
 public:
  TrustRun(const TrustCase& trial, const TrustModels& models, const sim::SimulationConfig& rig,
           rt::SceneSpec scene, std::vector<Act> acts);
  TrustRun(const TrustRun&) = delete;
  ~TrustRun();

  void step();

  hal::RigSample sample{};
  hal::TruthSample truth{};
  rt::TickRecord record{};
  double now_s = 0.0;
  double before_s = 0.0;         ///< the tick before
  sim::HandProgram::Kind act{};  ///< what the hand does now
  bool silent = false;           ///< the guard lets nothing through

 private:
  void bias_wrongly();

  double biased_at_n_;
  std::vector<Act> acts_;
  std::size_t next_act_ = 0;
  std::unique_ptr<sim::SimulatedRig> rig_;
  rt::GuardLimits limits_;
  std::unique_ptr<rt::Pipeline> pipeline_;
  std::unique_ptr<rt::Renderer> renderer_;
  hal::Vector3 bias_n_;
  std::uint32_t biases_ = 0;
  double silent_since_s_ = -1.0;
};

TrustOutcome run_trust_case(const TrustCase& trial, const TrustModels& models);

/// The scene of a case, and the rig it runs on.
rt::SceneSpec trust_scene(const TrustCase& trial);
sim::SimulationConfig trust_rig(const TrustCase& trial);

}  // namespace hapticd::study
