#pragma once

#include "tests/measure/study/common/study.h"

namespace hapticd::study {

/// The first section of `hapticd_study report`: what ships, the largest errors, the narrowest margins.
void summarize_report(StudyContext& context);

/// report.html of a study: all sections in its folder, for readers who did not write it.
void write_page(const Study& study, const StudyContext& context);

}  // namespace hapticd::study
