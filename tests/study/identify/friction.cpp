#include "tests/study/identify/identify_study.h"

namespace hapticd::study {

void run_identify_friction(StudyContext&) {}

}  // namespace hapticd::study
