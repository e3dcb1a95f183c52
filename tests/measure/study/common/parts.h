#pragma once

#include "tests/measure/study/common/study.h"

namespace hapticd::study {

/// Parts of the studies; studies.cpp says what each shows.
using Part = void(StudyContext& context);

// rig
Part run_rendered_stiffness, run_transported_stiffness, run_contact, run_stability, run_speed;
// explore
Part run_explore_contact, run_estimation, run_explore_stability, run_explore_rendered;
// identify
Part run_identify_contact, run_identify_friction, run_identify_rig;
Part run_identify_shipped_models, run_identify_transport;
Part run_identify_contact_recordings, run_identify_compression_recordings, run_identify_friction_recordings;
Part run_identify_handover;
// tumour, registration
Part run_tumour_force, run_inclusion_place, run_registration;
// experiments: each a program in Python
Part run_estimators, run_chain, run_resume, run_guided_presses, run_python_telemetry;
// friction, transients
Part run_friction_target, run_friction_stiffness, run_transient_frequency, run_transient_hardness;
// faults, loading, onset
Part run_faults, run_loading_error, run_loading_budget, run_onset, run_onset_live;
// stability, uncertainty
Part run_granted_stability, run_displacement_coverage, run_parameter_coverage;
// report
Part run_motion_precision, run_detection_precision, run_estimation_precision, run_modulation_precision;
Part run_identification_precision, run_rate_precision, run_integrator_precision;
Part run_stability_maps, run_inclusion_stability, run_stability_sensitivity;
Part run_extremes, run_traps, run_scene_economy, run_realtime_cost;

}  // namespace hapticd::study
