#pragma once

#include "tests/measure/study/common/study.h"

namespace hapticd::study {

/// Largest and longest force in free air, for every cause on every scene, device and rate.
void run_free_air(StudyContext& context);

/// Largest force in free air and largest step over all scenes, targets and stored models that are accepted.
void run_settings(StudyContext& context);

/// How much of the time in which an object is pressed is rendered, with zeros that are off or drift.
void run_rendered_share(StudyContext& context);

/// Real taps and presses under the same causes: what is missed, dropped, and how late it is found.
void run_contact_kept(StudyContext& context);

}  // namespace hapticd::study
