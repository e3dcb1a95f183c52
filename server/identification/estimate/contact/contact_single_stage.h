#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "server/identification/estimate/contact/contact_estimate.h"

namespace hapticd::identification {

/// Recursive single-stage log-linear estimator of (4.22) (D§4.5.1, Haddadi and Hashtrudi-Zaad):
///
///   ln f = ln K + m ln x + (B/K) ẋ,  weighted by f²,
///
/// over samples deeper than a tenth of the deepest, above a least force and with |B/K·ẋ| < 0.1, where the
/// linearisation holds. Recursive least squares with forgetting, in its information form: sums instead of a
/// covariance. They cannot wind up, lose definiteness or diverge on data that excite nothing, and they are
/// frozen out of contact. The sums are kept apart in cells of displacement and speed, so that the gates,
/// which depend on what is known only later, act on what was seen earlier too. Memory and time per sample are
/// constant.
class SingleStageEstimator {
 public:
  struct Options {
    double min_force_n = 0.1;
    double min_share = 0.1;          ///< of the deepest displacement
    double largest_rate_term = 0.1;  ///< |B/K·ẋ|
    double forgetting = 1.0;         ///< λ per sample taken, 0.99 … 1
    std::size_t fewest_samples = 100;
    /// Number of consecutive samples whose mean is taken: a velocity averages over 15 ms, so single
    /// milliseconds add work but no knowledge. 1 for slow recordings.
    int mean_of = 4;
  };

  SingleStageEstimator() : SingleStageEstimator(Options{}) {}
  explicit SingleStageEstimator(const Options& options);

  void add(const PalpationSample& sample) noexcept {
    if (!sample.in_contact || !(sample.normal_force_n > options_.min_force_n) ||
        !(sample.displacement_mm > kMinMm)) {
      gathered_ = 0;
      return;
    }
    if (gathered_ == 0) sum_mm_ = sum_mm_per_s_ = sum_n_ = 0.0;
    sum_mm_ += sample.displacement_mm;
    sum_mm_per_s_ += sample.rate_mm_per_s;
    sum_n_ += sample.normal_force_n;
    if (++gathered_ < options_.mean_of) return;
    gathered_ = 0;
    take(share_ * sum_mm_, share_ * sum_mm_per_s_, share_ * sum_n_);
  }
  /// Estimate; none while the data do not determine it. B ≥ 0, m within 1 … 3.
  std::optional<HuntCrossleyEstimate> estimate() const;
  std::size_t samples() const noexcept { return samples_ * static_cast<std::size_t>(options_.mean_of); }

 private:
  /// Weighted sums of φφᵀ and φ ln f, φ = [1, ln x, ẋ].
  struct Cell {
    double w = 0.0, wl = 0.0, wv = 0.0, wll = 0.0, wlv = 0.0, wvv = 0.0, wy = 0.0, wly = 0.0, wvy = 0.0;
    double count = 0.0;
    void add(const Cell& other, double share) noexcept;
  };
  static constexpr double kMinMm = 1.0 / 128.0;
  static constexpr std::size_t kDepths = 16 * 4;      ///< quarters of an octave, 2⁻⁷ … 2⁹ mm
  static constexpr std::size_t kSpeeds = 1 + 11 * 2;  ///< below 1 mm/s, half octaves up to 2¹¹ mm/s

  void take(double displacement_mm, double rate_mm_per_s, double force_n) noexcept;
  void rescale() noexcept;
  Cell gated(double min_mm, double greatest_mm_per_s) const noexcept;

  Options options_;
  double share_ = 1.0;  ///< 1 / mean_of
  int gathered_ = 0;
  double sum_mm_ = 0.0, sum_mm_per_s_ = 0.0, sum_n_ = 0.0;
  double weight_ = 1.0;  ///< of the next sample: grows instead of all sums shrinking
  double deepest_mm_ = 0.0;
  std::size_t samples_ = 0;  ///< means taken
  std::vector<Cell> cells_;
};

}  // namespace hapticd::identification
