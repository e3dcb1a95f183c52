#pragma once

#include <array>
#include <cstddef>
#include <limits>
#include <optional>
#include <span>

#include "rt/deformation/creep_law.h"
#include "rt/model/models.h"
#include "server/identification/estimate/held_out_blocks.h"
#include "server/identification/gate/palpation_sample.h"

namespace hapticd::identification {

/// Creep law that was found, with what is known of its errors (see HuntCrossleyUncertainty for how).
struct CreepEstimate {
  rt::IdentifiedLaw<rt::CreepParameters> law;
  /// Standard errors of w_0, w_1 …; infinite for lags that the palpation does not determine.
  std::array<double, rt::CreepParameters::kLags + 1> weight_error{};
  /// Lags that a contact lasted long enough for; the weight of the others is 0.
  std::array<bool, rt::CreepParameters::kLags> lag_determined{};
  /// Relative standard error of Ψ at max_force_n and at half of it.
  double relative_displacement = std::numeric_limits<double>::infinity();
  double relative_displacement_half = std::numeric_limits<double>::infinity();
  double residual = std::numeric_limits<double>::quiet_NaN();  ///< rms left over rms displacement
  std::size_t samples = 0;
};

/// Retardation times for a creep law from samples this far apart: the law's own for a live loop; for slow
/// recordings four from ten steps to a thousand, since what is faster than the steps cannot be seen.
std::array<double, rt::CreepParameters::kLags> creep_times_s(double step_s) noexcept;

/// Batch fit of the creep law to a palpation from a rested object, fed sample by sample, pauses out of
/// contact included, in bounded memory: only the lags run over all samples; their values are kept thinned
/// out.
///
/// Ψ follows by non-negative least squares on its increments for given weights, the weights by pattern search
/// on the simplex (a separable problem); errors count relative to x + 5 % of the deepest.
///
/// A lag is free only if its force came to a share kMinReach of the force itself. Taps of 50 ms show next to
/// nothing of a lag of a second: its weight would only scale all forces alike, which Ψ makes up for, and the
/// displacement would double as soon as a press is held.
class CreepFit {
 public:
  struct Row {
    std::array<double, rt::CreepParameters::kLags + 1> force_n{};  ///< as it is, and lagged
    double displacement_mm = 0.0;
    double rate_mm_per_s = 0.0;
    double time_s = 0.0;
  };

  /// Force of a lag, as a share of the whole, below which a third of the weight changes the effective force
  /// by no more than 5 %.
  static constexpr double kMinReach = 0.15;

  /// `stride`: every stride-th sample is kept at first; at 1 kHz every single one adds nothing.
  explicit CreepFit(const std::array<double, rt::CreepParameters::kLags>& time_s, std::size_t stride = 3,
                    std::size_t capacity = 16'384);

  /// Adds a sample. `step_s`: since the sample before; the force is held over it.
  void add(const PalpationSample& sample, double step_s) noexcept;

  /// Begins a separate palpation: the object has rested.
  void rest() noexcept { lagged_n_ = {}; }

  struct Options {
    double surface_mm = 0.0;  ///< displacement counts from here
    std::size_t fewest_samples = 100;
    std::size_t max_rows = 16'384;               ///< fewer for a quick look
    const rt::CreepParameters* start = nullptr;  ///< weights to begin the search with
    double first_step = 0.1;                     ///< of the pattern search
    bool with_errors = true;
    /// True if the object answers at once: w_0 = 1, Ψ alone is found.
    bool elastic = false;
    HeldOutBlocks held_out{};  ///< of the rows
    /// Errors count as those of the force they amount to (by the secant stiffness) instead of relative to x:
    /// for predicting forces from displacements.
    bool for_force = false;
  };
  /// Solves; none if fewer than `fewest_samples` show anything.
  std::optional<CreepEstimate> solve(const Options& options) const;
  std::optional<CreepEstimate> solve() const { return solve(Options{}); }

  /// Rows that were kept, of samples in contact only.
  std::span<const Row> rows() const noexcept { return rows_.items(); }
  const std::array<double, rt::CreepParameters::kLags>& time_s() const noexcept { return time_s_; }

 private:
  std::array<double, rt::CreepParameters::kLags> time_s_;
  std::array<double, rt::CreepParameters::kLags> lagged_n_{};
  std::array<double, rt::CreepParameters::kLags> decay_{};
  double decay_step_s_ = -1.0;  ///< the step decay_ belongs to
  ThinnedSeries<Row> rows_;
};

}  // namespace hapticd::identification
