#pragma once

#include <vector>

namespace hapticd::study {

/// What an estimate makes of one motion.
struct MotionError {
  double error = 0.0;  ///< rms of (estimate - truth) at the same tick over rms of truth
  double rms = 0.0;    ///< rms of (estimate - truth), in the estimate's unit
  double lag_ms =
      0.0;            ///< shift of the truth, in steps of 0.1 ms up to 50 ms, at which the estimate fits best
  double rest = 0.0;  ///< the error at that shift: noise and shape
};

/// `estimate`: one value a tick of 1 ms; `truth`: ten, the first at the first tick. The first 100 ms do not
/// count.
MotionError judge_motion(const std::vector<double>& estimate, const std::vector<double>& truth);

}  // namespace hapticd::study
