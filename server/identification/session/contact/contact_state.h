#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "server/identification/estimate/contact/contact_creep_fit.h"
#include "server/identification/estimate/contact/contact_estimate.h"
#include "server/identification/estimate/contact/contact_law_choice.h"
#include "server/identification/estimate/contact/contact_single_stage.h"
#include "server/identification/estimate/contact/contact_surface.h"
#include "server/identification/gate/palpation_tracker.h"
#include "server/identification/gate/sample_gate.h"
#include "server/identification/session/contact/contact_identification.h"
#include "server/identification/session/contact/contact_refusal.h"
#include "server/identification/session/contact/contact_requests.h"
#include "server/identification/session/contact/coverage_map.h"

namespace hapticd::identification {

inline constexpr std::size_t kContactSamplesKept = 16'384;
inline constexpr double kSnapshotS = 0.25;  ///< of contact, between looks at whether the estimate still moves

/// Quantities of an estimate that have to come to rest.
struct ContactSnapshot {
  double contact_s = 0.0;
  double log_force = 0.0, log_force_half = 0.0;  ///< at the deepest and at half of it
  double exponent = 0.0;
  double rate_term = 0.0;  ///< B/K at the required speed
};

ContactSnapshot snapshot_of(const HuntCrossleyEstimate& estimate, double contact_s, double deepest_mm,
                            double speed_mm_per_s);

/// Palpation under way: the samples kept of it and what was made of them.
struct ContactIdentification::State {
  State(const ContactTask& contact_task, const hal::RigInfo& rig_info)
      : task(contact_task),
        rig(rig_info),
        recorded(rig_info.kind == hal::RigKind::kReplay),
        gate(palpation_policy(rig_info)),
        tracker(rig_info.sensor.tool_mass_g, contact_task.threshold_n,
                rig_info.device.position_resolution_mm > 0.0 ? rig_info.device.position_resolution_mm : 0.03,
                rig_info.rate_hz),
        recording(contact_task.threshold_n, rig_info.rate_hz),
        single(single_options()),
        creep(creep_times_s(1.0 / rig_info.rate_hz), recorded ? 1 : 3),
        kept(kContactSamplesKept) {}

  bool wants_hunt_crossley() const { return !task.law || *task.law == rt::ContactLawKind::kHuntCrossley; }
  bool wants_creep() const { return !task.law || *task.law == rt::ContactLawKind::kCreep; }

  SingleStageEstimator::Options single_options() const {
    SingleStageEstimator::Options options;
    options.min_force_n = 5.0 * task.threshold_n;
    if (recorded) options.fewest_samples = 30;
    options.mean_of = std::clamp(static_cast<int>(rig.rate_hz / 250.0), 1, 4);
    return options;
  }

  // contact_identification.cpp: a sample at a time
  void take(const PalpationSample& sample);
  void track_hold(const PalpationSample& sample, double step_s);
  ContactDomain domain() const;

  // Fit to the samples kept, made when it is asked for and enough is new.
  struct Fit {
    bool made = false;
    double at_contact_s = -1.0;
    std::uint64_t at_used = 0;
    std::vector<PalpationSample> palpation;  ///< displacement from the surface
    std::optional<SurfaceEstimate> surface;
    std::optional<HuntCrossleyEstimate> hunt_crossley;
    HuntCrossleyUncertainty uncertainty;
    std::optional<CreepEstimate> creep;
    bool creeps = true;  ///< false: what creeps is not asked for, the curve is elastic
    Coverage coverage;
    ContactDomain domain;
    bool steady = false, certain = false, converged = false;
    PalpationNeeds needs;
  };
  // contact_fits.cpp
  void refresh();
  std::optional<HuntCrossleyEstimate> recursive(const std::vector<PalpationSample>& palpation) const;
  std::optional<HuntCrossleyEstimate> batch(const std::vector<PalpationSample>& palpation) const;
  std::optional<CreepEstimate> creep_law(const Fit& current, bool thorough) const;
  std::optional<ContactLawChoice> choice(const Fit& current) const;
  // contact_convergence.cpp
  void judge(Fit& next) const;
  bool steady_now(const Fit& next) const;
  PalpationNeeds needs_of(const Fit& current) const;
  // contact_words.cpp
  void list_parameters(const Fit& current, const std::optional<HuntCrossleyEstimate>& law,
                       const HuntCrossleyUncertainty& uncertainty,
                       const std::optional<CreepEstimate>& creep_found,
                       std::vector<rt::EstimatedParameter>& parameters) const;

  ContactTask task;
  hal::RigInfo rig;
  bool recorded;
  SampleGate gate;
  PalpationExtent extent;
  PalpationTracker tracker;
  RecordedPalpation recording;
  SingleStageEstimator single;
  CreepFit creep;
  ThinnedSeries<PalpationSample> kept;  ///< in contact

  bool started = false;
  std::int64_t first_ns = 0, last_ns = 0;
  double last_sample_s = 0.0;
  double contact_s = 0.0;
  double deepest_mm = 0.0, fastest_mm_per_s = 0.0, largest_n = 0.0;
  double held_s = 0.0, holding_s = 0.0;
  double next_snapshot_s = kSnapshotS;
  std::array<ContactSnapshot, 8> snapshots{};
  std::size_t snapshots_taken = 0;
  Fit fit;
  double creep_moved = 1.0;  ///< relative change of Ψ per second of contact between the last two looks
};

}  // namespace hapticd::identification
