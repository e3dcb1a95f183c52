#include "tests/study/stability/stability_study.h"

namespace hapticd::study {

void run_wood_plate(StudyContext& context) {
  context.report.say("not measured yet");
}

}  // namespace hapticd::study
