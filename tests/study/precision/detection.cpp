#include "tests/study/precision/precision_study.h"

namespace hapticd::study {

void run_detection_precision(StudyContext& context) {
  context.report.say("not measured yet");
}

}  // namespace hapticd::study
