#include "server/identification/estimate/contact/contact_single_stage.h"

#include <Eigen/Core>
#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>

#include "server/linear_algebra/linear_algebra.h"

namespace hapticd::identification {

namespace {

constexpr int kFraction = 52;

/// Index of the one of 2^bits equal parts of its octave in which a positive number lies, counted from
/// 2^first_octave on; the ends take what lies beyond.
std::size_t octave_part(double value, int bits, int first_octave, std::size_t parts) noexcept {
  const auto raw = static_cast<std::int64_t>(std::bit_cast<std::uint64_t>(value) >> (kFraction - bits));
  const std::int64_t first = static_cast<std::int64_t>(1023 + first_octave) << bits;
  return static_cast<std::size_t>(
      std::clamp<std::int64_t>(raw - first, 0, static_cast<std::int64_t>(parts) - 1));
}

/// The lower end of such a part.
double part_begins(std::size_t part, int bits, int first_octave) noexcept {
  const std::uint64_t raw = (static_cast<std::uint64_t>(1023 + first_octave) << bits) + part;
  return std::bit_cast<double>(raw << (kFraction - bits));
}

}  // namespace

SingleStageEstimator::SingleStageEstimator(const Options& options)
    : options_(options), share_(1.0 / options.mean_of), cells_(kDepths * kSpeeds) {}

void SingleStageEstimator::Cell::add(const Cell& o, double share) noexcept {
  w += share * o.w;
  wl += share * o.wl;
  wv += share * o.wv;
  wll += share * o.wll;
  wlv += share * o.wlv;
  wvv += share * o.wvv;
  wy += share * o.wy;
  wly += share * o.wly;
  wvy += share * o.wvy;
  count += share * o.count;
}

void SingleStageEstimator::take(double displacement_mm, double rate_mm_per_s, double force_n) noexcept {
  if (!std::isfinite(displacement_mm) || !std::isfinite(rate_mm_per_s) || !std::isfinite(force_n)) return;
  deepest_mm_ = std::max(deepest_mm_, displacement_mm);
  // What is too shallow now is too shallow for ever.
  if (displacement_mm < options_.min_share * deepest_mm_) return;
  const double speed = std::abs(rate_mm_per_s);
  const std::size_t fast = speed < 1.0 ? 0 : 1 + octave_part(speed, 1, 0, kSpeeds - 1);
  Cell& c = cells_[octave_part(displacement_mm, 2, -7, kDepths) * kSpeeds + fast];
  const double w = weight_ * force_n * force_n;
  const double l = std::log(displacement_mm);
  const double y = std::log(force_n);
  const double wl = w * l;
  const double wv = w * rate_mm_per_s;
  c.w += w;
  c.wl += wl;
  c.wv += wv;
  c.wll += wl * l;
  c.wlv += wl * rate_mm_per_s;
  c.wvv += wv * rate_mm_per_s;
  c.wy += w * y;
  c.wly += wl * y;
  c.wvy += wv * y;
  c.count += 1.0;
  ++samples_;
  if (options_.forgetting < 1.0) {
    weight_ /= options_.forgetting;
    if (weight_ > 1e100) rescale();
  }
}

void SingleStageEstimator::rescale() noexcept {
  const double share = 1.0 / weight_;
  for (Cell& c : cells_) {
    for (double* sum : {&c.w, &c.wl, &c.wv, &c.wll, &c.wlv, &c.wvv, &c.wy, &c.wly, &c.wvy}) *sum *= share;
  }
  weight_ = 1.0;
}

SingleStageEstimator::Cell SingleStageEstimator::gated(double min_mm,
                                                       double greatest_mm_per_s) const noexcept {
  Cell sum;
  // Cells on the edge count in part, so that an estimate does not jump as its gate moves.
  for (std::size_t depth = 0; depth < kDepths; ++depth) {
    const double from_mm = part_begins(depth, 2, -7);
    const double to_mm = part_begins(depth + 1, 2, -7);
    const double deep = std::clamp((to_mm - min_mm) / (to_mm - from_mm), 0.0, 1.0);
    if (deep == 0.0) continue;
    for (std::size_t fast = 0; fast < kSpeeds; ++fast) {
      const double from = fast > 0 ? part_begins(fast - 1, 1, 0) : 0.0;
      const double to = part_begins(fast, 1, 0);
      if (from >= greatest_mm_per_s) break;
      const Cell& cell = cells_[depth * kSpeeds + fast];
      if (cell.count > 0.0) sum.add(cell, deep * std::min(1.0, (greatest_mm_per_s - from) / (to - from)));
    }
  }
  return sum;
}

std::optional<HuntCrossleyEstimate> SingleStageEstimator::estimate() const {
  if (samples() < options_.fewest_samples) return std::nullopt;
  double greatest_mm_per_s = std::numeric_limits<double>::infinity();
  HuntCrossleyEstimate estimate;
  for (int pass = 0; pass < 6; ++pass) {
    const Cell s = gated(options_.min_share * deepest_mm_, greatest_mm_per_s);
    if (s.count * options_.mean_of < static_cast<double>(options_.fewest_samples)) return std::nullopt;
    Eigen::Matrix3d normal;
    normal << s.w, s.wl, s.wv, s.wl, s.wll, s.wlv, s.wv, s.wlv, s.wvv;
    Eigen::Vector3d right(s.wy, s.wly, s.wvy);
    Eigen::Vector3d solution = Eigen::Vector3d::Zero();
    const Eigen::Vector3d scale = normal.diagonal().cwiseSqrt().cwiseMax(1e-150).cwiseInverse();
    const Eigen::Matrix3d scaled = scale.asDiagonal() * normal * scale.asDiagonal();
    if (const auto x = linear_algebra::solve_symmetric(scaled, scale.asDiagonal() * right, 1e-9)) {
      solution = scale.asDiagonal() * *x;
    }
    if (!(solution(2) > 0.0)) {
      // Rates that say nothing, or that show an object which gives energy, are fitted without damping.
      const auto two = linear_algebra::solve_symmetric(scaled.topLeftCorner<2, 2>(),
                                                       scale.head<2>().asDiagonal() * right.head<2>(), 1e-7);
      if (!two) return std::nullopt;
      solution.head<2>() = scale.head<2>().asDiagonal() * *two;
      solution(2) = 0.0;
    }
    const double exponent = std::clamp(solution(1), 1.0, 3.0);
    if (exponent != solution(1)) {
      // On the bound: K and B/K as they are best there.
      Eigen::Matrix2d rest;
      rest << s.w, s.wv, s.wv, s.wvv;
      const Eigen::Vector2d left(s.wy - exponent * s.wl, s.wvy - exponent * s.wlv);
      const double determinant = rest.determinant();
      const bool reported = solution(2) > 0.0 && determinant > 1e-9 * s.w * s.wvv;
      const double rate = reported ? std::max(0.0, (s.w * left(1) - s.wv * left(0)) / determinant) : 0.0;
      solution << (left(0) - rate * s.wv) / s.w, exponent, rate;
    }
    estimate.parameters.stiffness_n_per_mm_m = std::exp(solution(0));
    estimate.parameters.exponent = exponent;
    estimate.parameters.damping_n_s_per_mm_m1 = solution(2) * estimate.parameters.stiffness_n_per_mm_m;
    estimate.samples = static_cast<std::size_t>(s.count) * static_cast<std::size_t>(options_.mean_of);
    if (!(solution(2) > 0.0)) break;
    const double limit = options_.largest_rate_term / solution(2);
    if (std::abs(limit - greatest_mm_per_s) < 1e-3 * limit) break;
    greatest_mm_per_s = limit;
  }
  if (!std::isfinite(estimate.parameters.stiffness_n_per_mm_m)) return std::nullopt;
  return estimate;
}

}  // namespace hapticd::identification
