#pragma once

#include "tests/measure/study/common/study.h"

namespace hapticd::study {

/// Error against run time of every way there is to do a stage's work (work_precision.h), on the same data.

/// Velocity and acceleration from encoder positions.
void run_motion_precision(StudyContext& context);

/// Contact: delay of detection against false alarms in free motion.
void run_detection_precision(StudyContext& context);

/// Direction, displacement and friction while pressing and stroking.
void run_estimation_precision(StudyContext& context);

/// Inclusions, friction targets and transients.
void run_modulation_precision(StudyContext& context);

/// Identification of the contact law: recursive, gated, double-stage, batch.
void run_identification_precision(StudyContext& context);

/// Rate of the loop, 0.5 … 10 kHz; rate of the telemetry.
void run_rate_precision(StudyContext& context);

/// The simulator: integrators and steps against a converged reference, with the observed order.
void run_integrator_precision(StudyContext& context);

}  // namespace hapticd::study
