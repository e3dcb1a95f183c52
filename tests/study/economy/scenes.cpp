#include "tests/study/economy/economy_study.h"

namespace hapticd::study {

void run_scene_economy(StudyContext& context) {
  context.report.say("not measured yet");
}

}  // namespace hapticd::study
