#include "tests/study/stability/stability_study.h"

namespace hapticd::study {

void run_stability_maps(StudyContext& context) {
  context.report.say("not measured yet");
}

}  // namespace hapticd::study
