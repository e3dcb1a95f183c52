#include "tests/measure/study/precision/motion/motion_judge.h"

#include <cmath>
#include <cstddef>
#include <limits>

#include "tests/measure/study/precision/motion/motion_traces.h"

namespace hapticd::study {

namespace {

constexpr std::size_t kFine = MotionTrace::kStepsPerTick;
constexpr std::size_t kSettledTicks = 100;
constexpr std::size_t kMaxLag = 50 * kFine;

/// Sums over the ticks that count.
struct Squares {
  double left = 0.0;   ///< of (estimate - truth)
  double whole = 0.0;  ///< of the truth
  double ratio() const { return std::sqrt(left / whole); }
};

/// The truth of `lag` tenths of a tick ago.
Squares squares(const std::vector<double>& estimate, const std::vector<double>& truth, std::size_t lag) {
  Squares sums;
  for (std::size_t k = kSettledTicks; k < estimate.size(); ++k) {
    const double then = truth[k * kFine - lag];
    sums.left += (estimate[k] - then) * (estimate[k] - then);
    sums.whole += truth[k * kFine] * truth[k * kFine];
  }
  return sums;
}

}  // namespace

MotionError judge_motion(const std::vector<double>& estimate, const std::vector<double>& truth) {
  const Squares now = squares(estimate, truth, 0);
  MotionError result;
  result.error = now.ratio();
  result.rms = std::sqrt(now.left / static_cast<double>(estimate.size() - kSettledTicks));
  const auto best_lag = [&](std::size_t from, std::size_t to, std::size_t step) {
    result.rest = std::numeric_limits<double>::infinity();
    std::size_t best = from;
    for (std::size_t lag = from; lag <= to; lag += step) {
      const double error = squares(estimate, truth, lag).ratio();
      if (error >= result.rest) continue;
      result.rest = error;
      best = lag;
    }
    return best;
  };
  const std::size_t near = best_lag(0, kMaxLag, kFine);
  const std::size_t lag = best_lag(near > kFine ? near - kFine : 0, near + kFine, 1);
  result.lag_ms = static_cast<double>(lag) / static_cast<double>(kFine) * (1e3 / MotionTrace::kRateHz);
  return result;
}

}  // namespace hapticd::study
