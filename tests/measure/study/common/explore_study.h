#pragma once

#include <string>

#include "tests/measure/study/common/palpation.h"
#include "tests/measure/study/common/study.h"

namespace hapticd::study {

/// The model of a simulated object of the current plant, identified on it once a run by the service's own
/// sessions; with a Hunt-Crossley law in any case.
const IdentificationResult& identified(const std::string& object);

/// What is identified on the four objects of D§4, and how well it fits; the models as files.
void run_models(StudyContext& context);

/// Threshold by the zero-false-alarm procedure, delay of detection.
void run_explore_contact(StudyContext& context);

/// Direction and displacement while pressing and stroking, all estimators on the same strokes.
void run_estimation(StudyContext& context);

/// Largest stable target while stroking, against the pipeline of the dissertation.
void run_explore_stability(StudyContext& context);

/// Stiffness at the simulated hand at the targets of D§4.7.
void run_explore_rendered(StudyContext& context);

/// Whether the pipeline of the dissertation shows here what it showed there.
void run_phenomena(StudyContext& context);

/// Sticky objects and ridges, which the dissertation's pipeline could not hold.
void run_difficult(StudyContext& context);

/// Gains by the ultimate-gain search of D§3.3.2.
void run_gains(StudyContext& context);

}  // namespace hapticd::study
