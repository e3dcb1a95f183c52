#include "tests/study/identify/identify_study.h"

namespace hapticd::study {

void run_identify_friction_recordings(StudyContext&) {}

}  // namespace hapticd::study
