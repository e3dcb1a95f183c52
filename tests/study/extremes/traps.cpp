#include "tests/study/extremes/extremes_study.h"

namespace hapticd::study {

void run_traps(StudyContext& context) {
  context.report.say("not measured yet");
}

}  // namespace hapticd::study
