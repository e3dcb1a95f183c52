#pragma once

#include "tests/measure/study/common/study.h"

namespace hapticd::study {

/// Parts of the study of perception experiments, each a program in Python next to this file.
void run_estimators(StudyContext& context);
void run_chain(StudyContext& context);
void run_resume(StudyContext& context);
void run_guided_presses(StudyContext& context);
void run_python_telemetry(StudyContext& context);

}  // namespace hapticd::study
