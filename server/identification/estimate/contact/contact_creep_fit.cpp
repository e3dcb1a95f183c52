#include "server/identification/estimate/contact/contact_creep_fit.h"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <vector>

#include "server/identification/estimate/contact/contact_sandwich.h"
#include "server/linear_algebra/linear_algebra.h"

namespace hapticd::identification {

namespace {

constexpr Eigen::Index kSteps = rt::CreepParameters::kKnots - 1;
constexpr std::size_t kWeights = rt::CreepParameters::kLags + 1;
using Curve = Eigen::Matrix<double, kSteps, kSteps>;
using Steps = Eigen::Matrix<double, kSteps, 1>;

/// Minimises |A y - b| with y ≥ 0 from the normal equations: Lawson and Hanson's active set.
Steps non_negative_least_squares(const Curve& ata, const Steps& atb) {
  Steps y = Steps::Zero();
  std::array<bool, kSteps> free{};
  const auto is_free = [&](Eigen::Index i) -> bool& { return free[static_cast<std::size_t>(i)]; };
  const auto solve_free = [&] {
    std::vector<Eigen::Index> index;
    for (Eigen::Index i = 0; i < kSteps; ++i) {
      if (is_free(i)) index.push_back(i);
    }
    Steps s = Steps::Zero();
    if (index.empty()) return s;
    const Eigen::MatrixXd part = ata(index, index);
    const Eigen::VectorXd right = atb(index);
    const Eigen::VectorXd solution = linear_algebra::solve_symmetric(part, right);
    for (std::size_t i = 0; i < index.size(); ++i) s(index[i]) = solution(static_cast<Eigen::Index>(i));
    return s;
  };
  for (Eigen::Index outer = 0; outer < 3 * kSteps; ++outer) {
    const Steps gradient = atb - ata * y;
    Eigen::Index enter = -1;
    double steepest = 1e-10 * atb.cwiseAbs().maxCoeff();
    for (Eigen::Index i = 0; i < kSteps; ++i) {
      if (!is_free(i) && gradient(i) > steepest) {
        steepest = gradient(i);
        enter = i;
      }
    }
    if (enter < 0) break;
    is_free(enter) = true;
    for (Eigen::Index inner = 0; inner < kSteps; ++inner) {
      const Steps s = solve_free();
      double step = 1.0;
      for (Eigen::Index i = 0; i < kSteps; ++i) {
        if (is_free(i) && s(i) <= 0.0) step = std::min(step, y(i) / (y(i) - s(i)));
      }
      y += step * (s - y);
      if (step >= 1.0) break;
      for (Eigen::Index i = 0; i < kSteps; ++i) {
        if (is_free(i) && y(i) <= 1e-14) {
          is_free(i) = false;
          y(i) = 0.0;
        }
      }
    }
  }
  return y;
}

struct Point {
  std::array<double, kWeights> force_n;
  double displacement_mm, weight;
};

/// Place on the parabola of knots of an effective force.
struct Place {
  Eigen::Index knot;
  double share, newtons;
};
Place place_of(double effective_n, double largest_n) {
  const double at = static_cast<double>(kSteps) * std::sqrt(std::max(0.0, effective_n) / largest_n);
  const auto j = std::min<Eigen::Index>(static_cast<Eigen::Index>(at), kSteps - 1);
  const auto knot = static_cast<double>(j);
  const double unit = largest_n / static_cast<double>(kSteps * kSteps);
  const double from = unit * knot * knot;
  const double width = unit * (2.0 * knot + 1.0);
  return {j, (std::max(0.0, effective_n) - from) / width, width};
}

/// Solver of the inner problem: Ψ for given weights.
class Curves {
 public:
  Curves(std::vector<Point> points, double deepest_mm)
      : points_(std::move(points)), effective_(points_.size()), deepest_mm_(deepest_mm) {}

  const std::vector<Point>& points() const { return points_; }

  /// Returns the mean squared relative error; fills in Ψ and max_force_n.
  double fit(rt::CreepParameters& parameters) {
    double sum = 0.0;
    for (const double w : parameters.weight) sum += w;
    std::array<double, kWeights> share{};
    for (std::size_t j = 0; j < kWeights; ++j) share[j] = parameters.weight[j] / sum;
    double largest = 0.0;
    for (std::size_t i = 0; i < points_.size(); ++i) {
      double e = 0.0;
      for (std::size_t j = 0; j < kWeights; ++j) e += share[j] * points_[i].force_n[j];
      effective_[i] = e;
      largest = std::max(largest, e);
    }
    parameters.max_force_n = largest;

    // x = Σ_{k<j} step_k + t step_j: straight between the knots, close enough to the cubic for a fit. As all
    // coefficients before the last are one, sums per interval give the normal equations.
    std::array<double, kSteps> s0{}, s1{}, s2{}, b0{}, b1{};
    double btb = 0.0;
    for (std::size_t i = 0; i < points_.size(); ++i) {
      const Place place = place_of(effective_[i], largest);
      const auto j = static_cast<std::size_t>(place.knot);
      const double w2 = points_[i].weight * points_[i].weight;
      const double b = points_[i].displacement_mm;
      s0[j] += w2;
      s1[j] += w2 * place.share;
      s2[j] += w2 * place.share * place.share;
      b0[j] += w2 * b;
      b1[j] += w2 * place.share * b;
      btb += w2 * b * b;
    }
    Curve ata;
    Steps atb;
    double beyond0 = 0.0, beyond_b = 0.0;
    for (Eigen::Index k = kSteps - 1; k >= 0; --k) {
      const auto j = static_cast<std::size_t>(k);
      atb(k) = beyond_b + b1[j];
      ata(k, k) = beyond0 + s2[j];
      for (Eigen::Index l = 0; l < k; ++l) ata(k, l) = ata(l, k) = beyond0 + s1[j];
      beyond0 += s0[j];
      beyond_b += b0[j];
    }
    // Knots that no sample determines take the slope of their neighbours.
    const double slight = 1e-6 * ata.trace() / kSteps;
    Curve regular = ata;
    for (Eigen::Index k = 0; k + 1 < kSteps; ++k) {
      const double a = 1.0 / static_cast<double>(2 * k + 1);
      const double c = 1.0 / static_cast<double>(2 * k + 3);
      regular(k, k) += slight * a * a;
      regular(k + 1, k + 1) += slight * c * c;
      regular(k, k + 1) -= slight * a * c;
      regular(k + 1, k) -= slight * a * c;
    }
    const Steps steps = non_negative_least_squares(regular, atb);
    double x = 0.0;
    for (Eigen::Index k = 0; k < kSteps; ++k) {
      x += std::max(steps(k), 1e-6 * deepest_mm_);
      parameters.displacement_mm[static_cast<std::size_t>(k) + 1] = x;
    }
    // For data that the law explains to the last bit rounding leaves less than nothing, and a search that
    // goes on while it finds a share less would not end.
    const double squared = std::max(0.0, btb - 2.0 * steps.dot(atb) + steps.dot(ata * steps));
    return squared / static_cast<double>(points_.size());
  }

 private:
  std::vector<Point> points_;
  std::vector<double> effective_;
  double deepest_mm_;
};

double effective_n(const Point& point, const rt::CreepParameters& law) {
  double e = 0.0;
  for (std::size_t j = 0; j < kWeights; ++j) e += law.weight[j] * point.force_n[j];
  return e;
}

/// Lags whose force came to a fair share of the force.
std::array<bool, rt::CreepParameters::kLags> determined_lags(const std::vector<Point>& points) {
  std::array<double, kWeights> max_n{};
  for (const Point& p : points) {
    for (std::size_t j = 0; j < kWeights; ++j) max_n[j] = std::max(max_n[j], p.force_n[j]);
  }
  std::array<bool, rt::CreepParameters::kLags> determined{};
  for (std::size_t l = 0; l < determined.size(); ++l) {
    determined[l] = max_n[l + 1] >= CreepFit::kMinReach * max_n[0];
  }
  return determined;
}

/// Fills in the errors. The weights sum to one: w_0 is what the others leave. `searched`: the
/// weights among those others that were found, 1 … kLags.
void find_errors(const std::vector<Point>& points, double deepest_mm,
                 const std::vector<std::size_t>& searched, CreepEstimate& estimate) {
  const rt::CreepParameters& parameters = estimate.law.parameters;
  const rt::CreepLaw law(parameters, 1000.0);
  double left = 0.0, whole = 0.0, relative = 0.0;
  std::size_t relative_count = 0;
  // Intervals that hold samples are parameters, the others only follow.
  std::array<std::size_t, kSteps> held{};
  for (const Point& p : points) {
    const double e = effective_n(p, parameters);
    const double error_mm = law.curve(e).displacement_mm - p.displacement_mm;
    left += error_mm * error_mm;
    whole += p.displacement_mm * p.displacement_mm;
    if (p.displacement_mm >= 0.1 * deepest_mm) {
      relative += std::pow(error_mm / p.displacement_mm, 2);
      ++relative_count;
    }
    ++held[static_cast<std::size_t>(place_of(e, parameters.max_force_n).knot)];
  }
  estimate.residual = whole > 0.0 ? std::sqrt(left / whole) : 0.0;
  estimate.law.relative_error =
      relative_count > 0 ? std::clamp(std::sqrt(relative / static_cast<double>(relative_count)), 1e-3, 1.0)
                         : 1.0;

  std::array<Eigen::Index, kSteps> column{};
  const auto weights = static_cast<Eigen::Index>(searched.size());
  Eigen::Index next = weights;
  for (std::size_t k = 0; k < held.size(); ++k) column[k] = held[k] > 2 ? next++ : -1;
  if (next == 0) return;
  constexpr int kMax = static_cast<int>(kSteps) + static_cast<int>(kWeights);
  SandwichCovariance<kMax> sandwich(next, points.size());
  SandwichCovariance<kMax>::Vector jacobian(next);
  for (const Point& p : points) {
    const double e = effective_n(p, parameters);
    const rt::LawEstimate at = law.curve(e);
    const Place place = place_of(e, parameters.max_force_n);
    for (Eigen::Index j = 0; j < weights; ++j) {
      jacobian(j) =
          p.weight * at.mm_per_n * (p.force_n[searched[static_cast<std::size_t>(j)]] - p.force_n[0]);
    }
    for (Eigen::Index k = 0; k < kSteps; ++k) {
      const Eigen::Index c = column[static_cast<std::size_t>(k)];
      if (c >= 0) jacobian(c) = k < place.knot ? p.weight : (k == place.knot ? p.weight * place.share : 0.0);
    }
    sandwich.add(jacobian, p.weight * (p.displacement_mm - at.displacement_mm));
  }
  const auto covariance = sandwich.covariance();
  double immediate = 0.0;
  for (Eigen::Index i = 0; i < weights; ++i) {
    estimate.weight_error[searched[static_cast<std::size_t>(i)]] = std::sqrt(std::max(0.0, covariance(i, i)));
    for (Eigen::Index j = 0; j < weights; ++j) immediate += covariance(i, j);
  }
  estimate.weight_error[0] = std::isnan(immediate) ? covariance(0, 0) : std::sqrt(std::max(0.0, immediate));
  if (!std::isfinite(covariance(0, 0))) return;
  const auto relative_at = [&](double newtons) {
    SandwichCovariance<kMax>::Vector gradient = SandwichCovariance<kMax>::Vector::Zero(next);
    const Place place = place_of(newtons, parameters.max_force_n);
    for (Eigen::Index k = 0; k <= place.knot; ++k) {
      const Eigen::Index c = column[static_cast<std::size_t>(k)];
      if (c >= 0) gradient(c) = k < place.knot ? 1.0 : place.share;
    }
    return std::sqrt(std::max(0.0, gradient.dot(covariance * gradient))) / law.curve(newtons).displacement_mm;
  };
  estimate.relative_displacement = relative_at(parameters.max_force_n);
  estimate.relative_displacement_half = relative_at(0.5 * parameters.max_force_n);
}

}  // namespace

std::array<double, rt::CreepParameters::kLags> creep_times_s(double step_s) noexcept {
  const rt::CreepParameters defaults;
  constexpr double kLoopStepS = 3e-3;
  if (step_s < kLoopStepS) return defaults.time_s;
  std::array<double, rt::CreepParameters::kLags> times{};
  for (std::size_t i = 0; i < times.size(); ++i) {
    times[i] = std::min(1e3, 10.0 * step_s * std::pow(100.0, static_cast<double>(i) / (times.size() - 1)));
  }
  return times;
}

CreepFit::CreepFit(const std::array<double, rt::CreepParameters::kLags>& time_s, std::size_t stride,
                   std::size_t capacity)
    : time_s_(time_s), rows_(capacity, stride) {}

void CreepFit::add(const PalpationSample& sample, double step_s) noexcept {
  if (!std::isfinite(sample.normal_force_n) || !std::isfinite(sample.displacement_mm)) return;
  const double force_n = sample.in_contact ? std::max(0.0, sample.normal_force_n) : 0.0;
  if (std::abs(step_s - decay_step_s_) > 1e-9) {
    for (std::size_t l = 0; l < decay_.size(); ++l) decay_[l] = std::exp(-std::max(0.0, step_s) / time_s_[l]);
    decay_step_s_ = step_s;
  }
  for (std::size_t l = 0; l < lagged_n_.size(); ++l) {
    lagged_n_[l] = force_n + (lagged_n_[l] - force_n) * decay_[l];
  }
  if (!sample.in_contact || !rows_.wants_next()) {
    rows_.skip();
    return;
  }
  Row row;
  row.force_n[0] = force_n;
  std::copy(lagged_n_.begin(), lagged_n_.end(), row.force_n.begin() + 1);
  row.displacement_mm = sample.displacement_mm;
  row.rate_mm_per_s = sample.rate_mm_per_s;
  row.time_s = sample.time_s;
  rows_.add(row);
}

std::optional<CreepEstimate> CreepFit::solve(const Options& options) const {
  const std::vector<Row>& rows = rows_.items();
  double deepest_mm = 0.0;
  for (const Row& row : rows) deepest_mm = std::max(deepest_mm, row.displacement_mm - options.surface_mm);
  const std::size_t every =
      rows.empty() ? 1 : (rows.size() - 1) / std::max<std::size_t>(1, options.max_rows) + 1;
  std::vector<Point> points;
  points.reserve(rows.size() / every + 1);
  double largest_n = 0.0, max_n = 0.0;
  for (const Row& row : rows) max_n = std::max(max_n, row.force_n[0]);
  for (std::size_t i = 0; i < rows.size(); i += every) {
    const double x = rows[i].displacement_mm - options.surface_mm;
    if (x < 0.01 * deepest_mm || options.held_out.contains(i, rows.size())) continue;
    const double relative = 1.0 / (x + 0.05 * deepest_mm);
    points.push_back(
        {rows[i].force_n, x, options.for_force ? relative * (rows[i].force_n[0] + 0.05 * max_n) : relative});
    largest_n = std::max(largest_n, rows[i].force_n[0]);
  }
  if (points.size() < options.fewest_samples || !(deepest_mm > 0.0) || !(largest_n > 0.0))
    return std::nullopt;

  Curves curves(std::move(points), deepest_mm);
  rt::CreepParameters best;
  best.time_s = time_s_;
  if (!options.elastic) best.weight = {0.6, 0.1, 0.1, 0.1, 0.1};
  if (!options.elastic && options.start != nullptr) best.weight = options.start->weight;
  const auto determined = determined_lags(curves.points());
  std::vector<std::size_t> searched;
  for (std::size_t l = 0; l < determined.size() && !options.elastic; ++l) {
    if (determined[l]) {
      searched.push_back(l + 1);
    } else {
      best.weight[0] += best.weight[l + 1];
      best.weight[l + 1] = 0.0;
    }
  }
  double least = curves.fit(best);
  // The error is smooth in the four free weights: a pattern search that halves its step finds the valley.
  for (double step = options.elastic ? 0.0 : options.first_step; step > 1e-3; step *= 0.5) {
    for (bool better = true; better;) {
      better = false;
      for (std::size_t j = 0; j < best.weight.size(); ++j) {
        if (j > 0 && !determined[j - 1]) continue;
        for (const double sign : {1.0, -1.0}) {
          rt::CreepParameters trial = best;
          trial.weight[j] = std::max(0.0, trial.weight[j] + sign * step);
          double sum = 0.0;
          for (const double w : trial.weight) sum += w;
          if (!(sum > 0.0) || trial.weight[0] / sum < 0.05) continue;
          for (double& w : trial.weight) w /= sum;
          const double error = curves.fit(trial);
          if (error < least * (1.0 - 1e-4)) {
            least = error;
            best = trial;
            better = true;
          }
        }
      }
    }
  }
  CreepEstimate estimate;
  estimate.law.parameters = best;
  estimate.samples = curves.points().size();
  estimate.weight_error.fill(options.elastic ? 0.0 : std::numeric_limits<double>::infinity());
  estimate.lag_determined = determined;
  if (options.with_errors) find_errors(curves.points(), deepest_mm, searched, estimate);
  return estimate;
}

}  // namespace hapticd::identification
