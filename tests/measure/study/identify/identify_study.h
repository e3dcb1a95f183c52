#pragma once

#include "tests/measure/study/common/study.h"

namespace hapticd::study {

// The parts of `hapticd_study identify`.
void run_identify_contact(StudyContext& context);             ///< laws and methods on the simulated objects
void run_identify_contact_recordings(StudyContext& context);  ///< silicone, meat, nano-indentation
void run_identify_compression_recordings(StudyContext& context);  ///< EcoFlex, compressed to two thirds
void run_identify_friction(StudyContext& context);  ///< rod and ball bearing on the simulated objects
void run_identify_friction_recordings(StudyContext& context);  ///< reciprocating and seal friction
void run_identify_shipped_models(StudyContext& context);  ///< the models in server/model/shipped, made again
void run_identify_rig(StudyContext& context);

/// Gains of the controller by the ultimate gain, pressed by a hand.
void run_identify_gains(StudyContext& context);      ///< structural stiffness, tool, threshold, gains
void run_identify_transport(StudyContext& context);  ///< the same over the emulated real transports, live
void run_identify_handover(StudyContext& context);   ///< tool and threshold from a hand-held sensor

}  // namespace hapticd::study
