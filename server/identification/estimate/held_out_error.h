#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <limits>

#include "server/identification/estimate/held_out_blocks.h"

namespace hapticd::identification {

/// Sums that give rms left over rms explained.
struct SquaredError {
  double left = 0.0, whole = 0.0;
  void add(double estimated, double measured, double weight = 1.0) noexcept {
    left += weight * (estimated - measured) * (estimated - measured);
    whole += weight * measured * measured;
  }
  double relative() const noexcept { return std::sqrt(left / whole); }
};

/// Error of a law on data it was not fitted to: rms left over rms of what it is to predict, each fold judged
/// by a fit to the others.
struct HeldOutError {
  double relative = std::numeric_limits<double>::infinity();  ///< infinite: it could not be fitted
  double deviation = 0.0;                                     ///< standard error, from the folds' scatter
};

/// True if a richer law is worth its extra parameters: better by more than its standard error (the
/// one-standard-error rule of Breiman et al. 1984).
inline bool pays(const HeldOutError& richer, const HeldOutError& simpler) noexcept {
  return richer.relative + richer.deviation < simpler.relative;
}

/// Folds of one law; a law that cannot be fitted to one of them has no error.
class HeldOutTrial {
 public:
  void add(const SquaredError& fold) noexcept {
    if (!(fold.whole > 0.0)) return;
    folds_[count_++] = fold;
    all_.left += fold.left;
    all_.whole += fold.whole;
  }
  void fail() noexcept { failed_ = true; }
  HeldOutError error() const noexcept {
    if (failed_ || count_ < 2 || !std::isfinite(all_.left)) return {};
    const double mean = all_.relative();
    double spread = 0.0;
    for (std::size_t i = 0; i < count_; ++i) spread += std::pow(folds_[i].relative() - mean, 2);
    return {mean, std::sqrt(spread / static_cast<double>(count_ * (count_ - 1)))};
  }

 private:
  std::array<SquaredError, HeldOutBlocks::kFolds> folds_{};
  std::size_t count_ = 0;
  SquaredError all_;
  bool failed_ = false;
};

}  // namespace hapticd::identification
