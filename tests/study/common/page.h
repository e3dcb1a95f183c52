#pragma once

#include "tests/study/common/study.h"

namespace hapticd::study {

/// The page of `hapticd_study report`: summary, then all sections in the folder.
void write_report_page(StudyContext& context);

}  // namespace hapticd::study
