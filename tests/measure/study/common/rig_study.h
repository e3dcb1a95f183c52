#pragma once

#include <string>
#include <vector>

#include "tests/measure/study/common/press.h"
#include "tests/measure/study/common/study.h"

namespace hapticd::study {

/// The objects of D§3.
inline const std::vector<std::string>& tapped_objects() {
  static const std::vector<std::string> names{"sponge_block", "foam_ball", "rubber_ball", "rubber_eraser"};
  return names;
}

/// A press to `force_n` in the scene `tap_1d`, held for three seconds; the last of them is judged.
PressTask tap_press(const std::string& device, const std::string& object, double target, bool compensated,
                    double force_n);

/// Real recordings replayed through `tap_1d`: contact instant, loading stiffness, force that would be
/// rendered.
void run_recordings(StudyContext& context);

/// Stiffness at the simulated hand against the target, held and while pressing, with and without structural
/// compensation.
void run_rendered_stiffness(StudyContext& context);

/// Runs the stiffness study live over the emulated real transports and, in virtual time, through the emulated
/// board, next to the direct rig: in one dimension and in three.
void run_transported_stiffness(StudyContext& context);

/// False alarms in free motion and delay of detection.
void run_contact(StudyContext& context);

/// Largest stable target on objects and walls, and what uncertain parameters do to it.
void run_stability(StudyContext& context);

/// How much faster than real time the simulated rig runs.
void run_speed(StudyContext& context);

}  // namespace hapticd::study
