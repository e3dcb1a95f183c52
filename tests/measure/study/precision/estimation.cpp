#include "tests/measure/study/common/parts.h"
#include "tests/measure/study/precision/estimation_stages.h"

namespace hapticd::study {

void run_estimation_precision(StudyContext& context) {
  run_stroke_precision(context);
  run_friction_precision(context);
}

}  // namespace hapticd::study
