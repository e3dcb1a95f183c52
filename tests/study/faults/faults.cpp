#include "tests/study/faults/faults_study.h"
namespace hapticd::study {
void run_faults(StudyContext&) {}
}  // namespace hapticd::study
