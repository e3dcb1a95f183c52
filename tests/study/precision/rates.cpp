#include "tests/study/precision/precision_study.h"

namespace hapticd::study {

void run_rate_precision(StudyContext& context) {
  context.report.say("not measured yet");
}

}  // namespace hapticd::study
