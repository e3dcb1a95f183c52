#include "tests/study/identify/identify_study.h"

namespace hapticd::study {

void run_identify_contact_recordings(StudyContext&) {}

}  // namespace hapticd::study
