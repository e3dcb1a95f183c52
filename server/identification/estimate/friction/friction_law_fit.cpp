#include "server/identification/estimate/friction/friction_law_fit.h"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

#include "rt/friction/dahl.h"
#include "server/identification/estimate/friction/friction_level.h"
#include "server/identification/estimate/friction/maxwell_slip_fit.h"
#include "server/identification/gate/stroke_passages.h"
#include "server/linear_algebra/least_squares.h"

namespace hapticd::identification {

namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kPreslidingDistanceMm = 0.5;  // D§4.4.1
constexpr double kMinPreslidingMm = 1e-3;
constexpr double kMaxPreslidingMm = 20.0;
constexpr double kMinInstants = 50.0;
constexpr int kRounds = 12;

/// z at each row.
std::vector<double> built_up(const std::vector<FrictionRow>& rows, rt::FrictionLaw law, double presliding_mm,
                             double exponent) {
  std::vector<double> z(rows.size());
  double now = 0.0;
  if (law == rt::FrictionLaw::kCoulombViscous) presliding_mm = 0.0;
  for (std::size_t i = 0; i < rows.size(); ++i) {
    now = rt::dahl_step(state_before(rows[i], now), rows[i].slide_mm, presliding_mm, exponent);
    z[i] = now;
  }
  return z;
}

class LawFit {
 public:
  LawFit(const std::vector<FrictionRow>& rows, const FrictionFitOptions& options)
      : rows_(rows), options_(options), trust_(rows.size(), 1.0), slope_(rows.size(), 1.0) {
    // A rolling tip has turned long before D's three millimetres.
    const double sliding_path_mm =
        options.law == rt::FrictionLaw::kDahl ? StrokePassages::kSlidingPathMm : 2.0 * kPreslidingDistanceMm;
    for (const FrictionRow& row : rows) {
      const bool usable =
          row.settled && row.weight > 0.0 && std::abs(row.speed_mm_per_s) >= options.min_speed_mm_per_s;
      const bool slides =
          usable && row.path_mm > sliding_path_mm && std::abs(row.speed_mm_per_s) >= options.sliding_mm_per_s;
      usable_.push_back(usable);
      sliding_.push_back(slides);
      const bool calm = usable && std::abs(row.speed_mm_per_s) <= options.presliding_mm_per_s;
      presliding_.push_back(calm && row.path_mm < sliding_path_mm);
      turning_.push_back(calm && row.path_mm < kPreslidingDistanceMm);
    }
  }

  hal::Result<FrictionLawFit> run() {
    FrictionLevelSums sliding;
    for (std::size_t i = 0; i < rows_.size(); ++i) {
      if (sliding_[i]) sliding.add(rows_[i], rows_[i].heading);
    }
    fit_.divided = sliding.instants() >= kMinInstants || options_.law == rt::FrictionLaw::kCoulombViscous;
    if (fit_.divided) {
      if (sliding.instants() < kMinInstants) {
        return cannot_fit_friction("too little of the strokes was sliding",
                                   std::to_string(std::llround(sliding.instants())) + " instants",
                                   "at least " + std::to_string(std::llround(kMinInstants)),
                                   "stroke farther and faster");
      }
      take(sliding.solve(options_.viscous, options_.bias));
      for (int round = 0; round < kRounds; ++round) {
        doubt();
        FrictionLevelSums again;
        for (std::size_t i = 0; i < rows_.size(); ++i) {
          if (sliding_[i]) again.add(rows_[i], rows_[i].heading, trust_[i]);
        }
        take(again.solve(options_.viscous, options_.bias));
      }
    }
    if (options_.law == rt::FrictionLaw::kDahl) {
      search();
      if (!fit_.divided) {
        const std::vector<double> z =
            built_up(rows_, options_.law, fit_.parameters.presliding_mm, fit_.parameters.exponent);
        const FrictionLevelSums all = together(z);
        if (all.instants() < kMinInstants) {
          return cannot_fit_friction(
              "too little of the strokes is of use",
              std::to_string(std::llround(all.instants())) + " instants after the first full stroke",
              "at least " + std::to_string(std::llround(kMinInstants)),
              "stroke back and forth several times");
        }
        take(all.solve(options_.viscous, options_.bias));
      }
    } else {
      fit_.parameters.presliding_mm = rt::kBallBearingFriction.presliding_mm;
    }
    if (!(fit_.parameters.kinetic > 0.0)) {
      std::string value = std::to_string(fit_.parameters.kinetic);
      return cannot_fit_friction("friction goes along with the motion instead of against it",
                                 "coefficient " + value, "greater than 0",
                                 "turn the sign of the force or of the position");
    }
    judge();
    return fit_;
  }

 private:
  void take(const FrictionLevel& linear) {
    fit_.parameters.kinetic = linear.kinetic;
    fit_.parameters.viscous_n_s_per_mm = linear.viscous;
    fit_.bias_n = linear.bias;
    fit_.viscous_is_identified = linear.viscous_is_identified;
  }

  /// Weighs how far each moment of sliding is to be trusted: Tukey's biweight, scaled by the median
  /// deviation. What still builds up after three millimetres, or catches, differs from the level and shall
  /// not shift it.
  void doubt() {
    std::vector<double> deviations;
    for (std::size_t i = 0; i < rows_.size(); ++i) {
      if (sliding_[i])
        deviations.push_back(std::abs(rows_[i].friction_n - law_n(rows_[i], rows_[i].heading)));
    }
    const auto middle = deviations.begin() + static_cast<std::ptrdiff_t>(deviations.size() / 2);
    std::nth_element(deviations.begin(), middle, deviations.end());
    constexpr double kDeviationPerMedian = 1.4826;
    constexpr double kBeyondDoubt = 4.685;
    // Least error as a share of the level: an exact fit leaves rounding errors, of which none is worse than
    // the other.
    constexpr double kMinOfLevel = 0.01;
    double largest_n = 0.0;
    for (std::size_t i = 0; i < rows_.size(); ++i) {
      if (sliding_[i]) {
        largest_n = std::max(largest_n, std::abs(fit_.parameters.kinetic * rows_[i].normal_n));
      }
    }
    const double reach = std::max(kBeyondDoubt * kDeviationPerMedian * *middle, kMinOfLevel * largest_n);
    for (std::size_t i = 0; i < rows_.size(); ++i) {
      if (!sliding_[i] || !(reach > 0.0)) continue;
      const double off_n = rows_[i].friction_n - law_n(rows_[i], rows_[i].heading);
      const double u = off_n / reach;
      trust_[i] = linear_algebra::tukey(off_n, reach);
      slope_[i] = std::abs(u) < 1.0 ? (1.0 - u * u) * (1.0 - 5.0 * u * u) : 0.0;
    }
  }

  FrictionLevelSums together(const std::vector<double>& z) const {
    FrictionLevelSums sums;
    for (std::size_t i = 0; i < rows_.size(); ++i) {
      if (usable_[i]) sums.add(rows_[i], z[i]);
    }
    return sums;
  }

  /// Cost of what presliding and exponent leave unexplained.
  double cost(double presliding_mm, double exponent, bool refine = true) const {
    const std::vector<double> z = built_up(rows_, options_.law, presliding_mm, exponent);
    if (!fit_.divided) return together(z).solve(options_.viscous, options_.bias).left;
    double sum = 0.0;
    for (std::size_t i = 0; i < rows_.size(); ++i) {
      if (!(refine ? presliding_[i] : turning_[i])) continue;
      const double error = rows_[i].friction_n - law_n(rows_[i], z[i]);
      sum += rows_[i].weight * error * error;
    }
    return sum;
  }
  double law_n(const FrictionRow& row, double z) const {
    return fit_.parameters.kinetic * row.normal_n * z +
           fit_.parameters.viscous_n_s_per_mm * row.speed_mm_per_s + fit_.bias_n;
  }

  /// Searches by a ladder over the presliding way, then a pattern search that halves its step, over the
  /// exponent as well.
  void search() {
    double max_mm = 0.0;
    for (const FrictionRow& row : rows_) max_mm = std::max(max_mm, row.path_mm);
    max_mm = std::clamp(2.0 * max_mm, 10.0 * kMinPreslidingMm, kMaxPreslidingMm);
    if (fit_.divided) max_mm = std::min(max_mm, StrokePassages::kSlidingPathMm);
    double best_mm = kMinPreslidingMm;
    double least = kInfinity;
    for (double trial_mm = kMinPreslidingMm; trial_mm < max_mm; trial_mm *= 1.3) {
      const double c = cost(trial_mm, 1.0, false);
      if (c < least) {
        least = c;
        best_mm = trial_mm;
      }
    }
    least = cost(best_mm, 1.0);
    double log_mm = std::log(best_mm);
    double exponent = 1.0;
    if (options_.exponent) {
      for (const double start : {0.1, 0.5}) {
        const double c = cost(best_mm, start);
        if (c < least) {
          least = c;
          exponent = start;
        }
      }
    }
    double step_log = 0.15;
    double step_exponent = 0.2;
    while (step_log > 1e-3) {
      bool better = false;
      const auto attempt = [&](double trial_log, double trial_exponent) {
        trial_exponent = std::clamp(trial_exponent, 0.0, options_.max_exponent);
        trial_log = std::clamp(trial_log, std::log(kMinPreslidingMm), std::log(max_mm));
        const double c = cost(std::exp(trial_log), trial_exponent);
        if (!(c < least * (1.0 - 1e-9))) return;
        least = c;
        log_mm = trial_log;
        exponent = trial_exponent;
        better = true;
      };
      attempt(log_mm + step_log, exponent);
      attempt(log_mm - step_log, exponent);
      if (options_.exponent) {
        attempt(log_mm, exponent + step_exponent);
        attempt(log_mm, exponent - step_exponent);
      }
      if (better) continue;
      step_log *= 0.5;
      step_exponent *= 0.5;
    }
    fit_.parameters.presliding_mm = std::exp(log_mm);
    fit_.parameters.exponent = exponent;
  }

  /// Computes residuals and standard errors.
  void judge() {
    const rt::FrictionParameters& p = fit_.parameters;
    const bool dahl = options_.law == rt::FrictionLaw::kDahl;
    const std::vector<double> z = built_up(rows_, options_.law, p.presliding_mm, p.exponent);
    constexpr double kNudge = 0.01;
    std::vector<double> z_longer, z_bent;
    if (dahl) z_longer = built_up(rows_, options_.law, p.presliding_mm * (1.0 + kNudge), p.exponent);
    const double bend = p.exponent + kNudge > options_.max_exponent ? -kNudge : kNudge;
    if (dahl && options_.exponent) z_bent = built_up(rows_, options_.law, p.presliding_mm, p.exponent + bend);

    constexpr Eigen::Index kMax = 5;
    using Vector = Eigen::Matrix<double, kMax, 1>;
    Eigen::Matrix<double, kMax, kMax> bread = Eigen::Matrix<double, kMax, kMax>::Zero();
    std::map<int, Vector> scores;
    double left = 0.0, squared = 0.0, left_abs = 0.0, friction_abs = 0.0;
    for (std::size_t i = 0; i < rows_.size(); ++i) {
      if (!usable_[i]) continue;
      const FrictionRow& row = rows_[i];
      if (!dahl && row.path_mm < 2.0 * kPreslidingDistanceMm) continue;
      const double error = row.friction_n - law_n(row, z[i]);
      left += row.weight * error * error;
      const double friction_n = row.friction_n - fit_.bias_n;
      squared += row.weight * friction_n * friction_n;
      left_abs += row.weight * std::abs(error);
      friction_abs += row.weight * std::abs(friction_n);
      fit_.rows += row.weight;
      if (fit_.divided && !sliding_[i] && !presliding_[i]) continue;
      Vector a = Vector::Zero();
      a(0) = row.normal_n * z[i];
      if (fit_.viscous_is_identified) a(1) = row.speed_mm_per_s;
      if (options_.bias) a(2) = 1.0;
      if (dahl && !sliding_[i]) {
        a(3) = p.kinetic * row.normal_n * (z_longer[i] - z[i]) / (kNudge * p.presliding_mm);
        if (options_.exponent) a(4) = p.kinetic * row.normal_n * (z_bent[i] - z[i]) / bend;
      }
      const bool robust = sliding_[i] && fit_.divided;
      const double weight = row.weight * (robust ? trust_[i] : 1.0);
      bread += (robust ? row.weight * slope_[i] : weight) * a * a.transpose();
      auto& score = scores.try_emplace(row.passage, Vector::Zero()).first->second;
      score += weight * error * a;
    }
    fit_.passages = static_cast<int>(scores.size());
    fit_.residual = squared > 0.0 ? std::sqrt(left / squared) : 0.0;
    fit_.relative_error = friction_abs > 0.0 ? left_abs / friction_abs : 0.0;

    std::vector<Eigen::Index> free;
    for (Eigen::Index i = 0; i < kMax; ++i) {
      if (bread(i, i) > 0.0) free.push_back(i);
    }
    Vector error = Vector::Constant(kInfinity);
    const auto groups = static_cast<double>(scores.size());
    if (groups >= 3.0 && !free.empty()) {
      Eigen::MatrixXd meat = Eigen::MatrixXd::Zero(kMax, kMax);
      for (const auto& [passage, score] : scores) meat += score * score.transpose();
      // Scaled to a unit diagonal, so that millimetres and newtons can be compared.
      const Eigen::MatrixXd part = bread(free, free);
      const Eigen::VectorXd scale = part.diagonal().cwiseSqrt().cwiseInverse();
      const Eigen::MatrixXd scaled = scale.asDiagonal() * part * scale.asDiagonal();
      if (const auto inverse_of_scaled = linear_algebra::invert(scaled, 1e-12)) {
        const Eigen::MatrixXd inverse = scale.asDiagonal() * *inverse_of_scaled * scale.asDiagonal();
        const Eigen::MatrixXd covariance = inverse * meat(free, free) * inverse * (groups / (groups - 1.0));
        for (std::size_t i = 0; i < free.size(); ++i) {
          const auto j = static_cast<Eigen::Index>(i);
          error(free[i]) = std::sqrt(std::max(0.0, covariance(j, j)));
        }
      }
    }
    fit_.error.kinetic = error(0);
    fit_.error.viscous_n_s_per_mm = error(1);
    fit_.bias_error_n = options_.bias ? error(2) : 0.0;
    fit_.error.presliding_mm = error(3);
    fit_.error.exponent = options_.exponent ? error(4) : 0.0;
  }

  const std::vector<FrictionRow>& rows_;
  FrictionFitOptions options_;
  std::vector<bool> usable_, sliding_, presliding_, turning_;
  std::vector<double> trust_;
  std::vector<double> slope_;  ///< of trust · deviation over deviation: the bread of the sandwich
  FrictionLawFit fit_;
};

}  // namespace

hal::Result<FrictionLawFit> fit_friction_law(const std::vector<FrictionRow>& rows,
                                             const FrictionFitOptions& options) {
  bool turned = false;
  for (std::size_t i = 1; i < rows.size() && !turned; ++i) turned = rows[i].passage != rows[0].passage;
  if (!turned) {
    return cannot_fit_friction("the tip did not slide back and forth",
                               std::to_string(rows.size()) + " moments of sliding", "strokes both ways",
                               "stroke back and forth over the same place");
  }
  hal::Result<FrictionLawFit> fit = LawFit(rows, options).run();
  constexpr double kSigmas = 2.0;
  const bool doubtful = fit && options.doubt_viscous && fit->viscous_is_identified &&
                        fit->parameters.viscous_n_s_per_mm > 0.0 &&
                        fit->parameters.viscous_n_s_per_mm < kSigmas * fit->error.viscous_n_s_per_mm;
  if (!doubtful) return fit;
  // A viscous part that cannot be distinguished from zero only makes the level uncertain.
  FrictionFitOptions without = options;
  without.viscous = false;
  hal::Result<FrictionLawFit> simpler = LawFit(rows, without).run();
  if (!simpler) return fit;
  simpler->viscous_is_identified = true;
  simpler->error.viscous_n_s_per_mm = fit->error.viscous_n_s_per_mm;
  return simpler;
}

std::vector<double> predicted_friction_n(const std::vector<FrictionRow>& rows,
                                         const rt::FrictionParameters& parameters, rt::FrictionLaw law,
                                         double bias_n) {
  if (law == rt::FrictionLaw::kDahl && parameters.maxwell_slip) {
    return predicted_friction_n(rows, {*parameters.maxwell_slip, parameters.viscous_n_s_per_mm, bias_n, 0.0});
  }
  std::vector<double> friction = built_up(rows, law, parameters.presliding_mm, parameters.exponent);
  for (std::size_t i = 0; i < rows.size(); ++i) {
    friction[i] = parameters.kinetic * rows[i].normal_n * friction[i] +
                  parameters.viscous_n_s_per_mm * rows[i].speed_mm_per_s + bias_n;
  }
  return friction;
}

}  // namespace hapticd::identification
