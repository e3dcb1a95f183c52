#include "server/identification/estimate/friction/friction_law_fit.h"

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>

#include "rt/friction/dahl.h"
#include "server/identification/gate/stroke_passages.h"

namespace hapticd::rt {

namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kPreslidingDistanceMm = 0.5;  // D§4.4.1
constexpr double kMinPreslidingMm = 1e-3;
constexpr double kMaxPreslidingMm = 20.0;
constexpr double kMaxExponent = 3.0;
constexpr double kMinInstants = 50.0;
constexpr int kRounds = 12;
/// cos² of the angle between the regressors of level and viscosity beyond which they cannot be distinguished.
constexpr double kAlike = 0.95;

hal::Error cannot_fit(const std::string& what, const std::string& value, const std::string& limit,
                      const std::string& remedy) {
  return {what, "identification of friction", value, limit, remedy};
}

double state_before(const FrictionRow& row, double z) {
  switch (row.before) {
    case FrictionRow::State::kNothing:
      return 0.0;
    case FrictionRow::State::kForwards:
      return 1.0;
    case FrictionRow::State::kBackwards:
      return -1.0;
    case FrictionRow::State::kGoesOn:
      break;
  }
  return z;
}

/// z at each row.
std::vector<double> built_up(const std::vector<FrictionRow>& rows, FrictionLaw law, double presliding_mm,
                             double exponent) {
  std::vector<double> z(rows.size());
  double now = 0.0;
  if (law == FrictionLaw::kCoulombViscous) presliding_mm = 0.0;
  for (std::size_t i = 0; i < rows.size(); ++i) {
    now = dahl_step(state_before(rows[i], now), rows[i].slide_mm, presliding_mm, exponent);
    z[i] = now;
  }
  return z;
}

/// Level, viscosity and bias by weighted linear least squares; the state is given.
struct Linear {
  double kinetic = 0.0, viscous = 0.0, bias = 0.0;
  double left = 0.0;      ///< Σ w e²
  bool reported = false;  ///< was the viscosity
};

class LinearSums {
 public:
  void add(const FrictionRow& row, double z, double trust = 1.0) {
    const Eigen::Vector3d a(row.normal_n * z, row.speed_mm_per_s, 1.0);
    const double weight = row.weight * trust;
    ata_ += weight * a * a.transpose();
    atb_ += weight * row.friction_n * a;
    btb_ += weight * row.friction_n * row.friction_n;
    instants_ += weight;
  }
  double instants() const { return instants_; }
  double squared_n2() const { return btb_; }

  Linear solve(bool viscous, bool bias) const {
    Linear best;
    const double alike = ata_(0, 1) * ata_(0, 1) / (ata_(0, 0) * ata_(1, 1));
    best.reported = viscous && ata_(1, 1) > 0.0 && alike < kAlike;
    for (bool with_viscous = best.reported;; with_viscous = false) {
      std::vector<Eigen::Index> free{0};
      if (with_viscous) free.push_back(1);
      if (bias) free.push_back(2);
      const Eigen::MatrixXd part = ata_(free, free);
      const Eigen::VectorXd right = atb_(free);
      // Scaled to a unit diagonal: at the lightest touch newtons and millimetres a second are far apart.
      const Eigen::VectorXd scale =
          (part.diagonal().array() > 0.0).select(part.diagonal().array().max(1e-300).sqrt().inverse(), 1.0);
      const Eigen::MatrixXd scaled = scale.asDiagonal() * part * scale.asDiagonal();
      const Eigen::VectorXd x =
          scale.asDiagonal() * scaled.completeOrthogonalDecomposition().solve(scale.asDiagonal() * right);
      best.kinetic = x(0);
      best.viscous = with_viscous ? x(1) : 0.0;
      best.bias = bias ? x(free.size() == 3 ? 2 : 1) : 0.0;
      best.left = std::max(0.0, btb_ - 2.0 * x.dot(right) + x.dot(part * x));
      if (!with_viscous || best.viscous >= 0.0) return best;  // friction does not shrink with the speed
    }
  }

 private:
  Eigen::Matrix3d ata_ = Eigen::Matrix3d::Zero();
  Eigen::Vector3d atb_ = Eigen::Vector3d::Zero();
  double btb_ = 0.0;
  double instants_ = 0.0;
};

class LawFit {
 public:
  LawFit(const std::vector<FrictionRow>& rows, const FrictionFitOptions& options)
      : rows_(rows), options_(options), trust_(rows.size(), 1.0), slope_(rows.size(), 1.0) {
    // A rolling tip has turned long before D's three millimetres.
    const double sliding_path_mm =
        options.law == FrictionLaw::kDahl ? StrokePassages::kSlidingPathMm : 2.0 * kPreslidingDistanceMm;
    for (const FrictionRow& row : rows) {
      const bool usable =
          row.settled && row.weight > 0.0 && std::abs(row.speed_mm_per_s) >= options.least_speed_mm_per_s;
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
    LinearSums sliding;
    for (std::size_t i = 0; i < rows_.size(); ++i) {
      if (sliding_[i]) sliding.add(rows_[i], rows_[i].heading);
    }
    fit_.divided = sliding.instants() >= kMinInstants || options_.law == FrictionLaw::kCoulombViscous;
    if (fit_.divided) {
      if (sliding.instants() < kMinInstants) {
        return cannot_fit("too little of the strokes was sliding",
                          std::to_string(std::llround(sliding.instants())) + " instants",
                          "at least " + std::to_string(std::llround(kMinInstants)),
                          "stroke farther and faster");
      }
      take(sliding.solve(options_.viscous, options_.bias));
      for (int round = 0; round < kRounds; ++round) {
        doubt();
        LinearSums again;
        for (std::size_t i = 0; i < rows_.size(); ++i) {
          if (sliding_[i]) again.add(rows_[i], rows_[i].heading, trust_[i]);
        }
        take(again.solve(options_.viscous, options_.bias));
      }
    }
    if (options_.law == FrictionLaw::kDahl) {
      search();
      if (!fit_.divided) {
        const std::vector<double> z =
            built_up(rows_, options_.law, fit_.parameters.presliding_mm, fit_.parameters.exponent);
        const LinearSums all = together(z);
        if (all.instants() < kMinInstants) {
          return cannot_fit(
              "too little of the strokes is of use",
              std::to_string(std::llround(all.instants())) + " instants after the first full stroke",
              "at least " + std::to_string(std::llround(kMinInstants)),
              "stroke back and forth several times");
        }
        take(all.solve(options_.viscous, options_.bias));
      }
    } else {
      fit_.parameters.presliding_mm = kBallBearingFriction.presliding_mm;
    }
    if (!(fit_.parameters.kinetic > 0.0)) {
      std::string value = std::to_string(fit_.parameters.kinetic);
      return cannot_fit("friction goes along with the motion instead of against it", "coefficient " + value,
                        "greater than 0", "turn the sign of the force or of the position");
    }
    judge();
    return fit_;
  }

 private:
  void take(const Linear& linear) {
    fit_.parameters.kinetic = linear.kinetic;
    fit_.parameters.viscous_n_s_per_mm = linear.viscous;
    fit_.bias_n = linear.bias;
    fit_.viscous_is_identified = linear.reported;
  }

  /// How far each moment of sliding is to be trusted: Tukey's biweight, scaled by the median deviation. What
  /// still builds up after three millimetres, or catches, stands out from the level and shall not shift it.
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
    // An exact fit leaves rounding errors, of which none is worse than the other.
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
      const double u = (rows_[i].friction_n - law_n(rows_[i], rows_[i].heading)) / reach;
      trust_[i] = std::abs(u) < 1.0 ? (1.0 - u * u) * (1.0 - u * u) : 0.0;
      slope_[i] = std::abs(u) < 1.0 ? (1.0 - u * u) * (1.0 - 5.0 * u * u) : 0.0;
    }
  }

  LinearSums together(const std::vector<double>& z) const {
    LinearSums sums;
    for (std::size_t i = 0; i < rows_.size(); ++i) {
      if (usable_[i]) sums.add(rows_[i], z[i]);
    }
    return sums;
  }

  /// What presliding and exponent leave unexplained.
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

  /// A ladder over the presliding way, then a pattern search that halves its step, over the exponent as well.
  void search() {
    double most_mm = 0.0;
    for (const FrictionRow& row : rows_) most_mm = std::max(most_mm, row.path_mm);
    most_mm = std::clamp(2.0 * most_mm, 10.0 * kMinPreslidingMm, kMaxPreslidingMm);
    if (fit_.divided) most_mm = std::min(most_mm, StrokePassages::kSlidingPathMm);
    double best_mm = kMinPreslidingMm;
    double least = kInfinity;
    for (double trial_mm = kMinPreslidingMm; trial_mm < most_mm; trial_mm *= 1.3) {
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
        trial_exponent = std::clamp(trial_exponent, 0.0, kMaxExponent);
        trial_log = std::clamp(trial_log, std::log(kMinPreslidingMm), std::log(most_mm));
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

  /// Residuals and standard errors.
  void judge() {
    const FrictionParameters& p = fit_.parameters;
    const bool dahl = options_.law == FrictionLaw::kDahl;
    const std::vector<double> z = built_up(rows_, options_.law, p.presliding_mm, p.exponent);
    constexpr double kNudge = 0.01;
    std::vector<double> z_longer, z_bent;
    if (dahl) z_longer = built_up(rows_, options_.law, p.presliding_mm * (1.0 + kNudge), p.exponent);
    const double bend = p.exponent + kNudge > kMaxExponent ? -kNudge : kNudge;
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
      // Scaled to a unit diagonal, so that millimetres and newtons may stand side by side.
      const Eigen::MatrixXd part = bread(free, free);
      const Eigen::VectorXd scale = part.diagonal().cwiseSqrt().cwiseInverse();
      const Eigen::MatrixXd scaled = scale.asDiagonal() * part * scale.asDiagonal();
      const Eigen::FullPivLU<Eigen::MatrixXd> lu(scaled);
      if (lu.isInvertible() && lu.rcond() > 1e-12) {
        const Eigen::MatrixXd inverse = scale.asDiagonal() * lu.inverse() * scale.asDiagonal();
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
  std::vector<double> slope_;  ///< of trust · deviation over deviation: what a sandwich is bread of
  FrictionLawFit fit_;
};

/// min |A y - b| with y ≥ 0 but for the last component, which is free: Lawson and Hanson's active set on the
/// normal equations.
Eigen::VectorXd non_negative(const Eigen::MatrixXd& ata, const Eigen::VectorXd& atb, bool last_is_free) {
  const Eigen::Index n = atb.size();
  Eigen::VectorXd y = Eigen::VectorXd::Zero(n);
  std::vector<bool> active(static_cast<std::size_t>(n), false);
  const auto unbounded = [&](Eigen::Index i) { return last_is_free && i == n - 1; };
  const auto solve = [&] {
    std::vector<Eigen::Index> index;
    for (Eigen::Index i = 0; i < n; ++i) {
      if (active[static_cast<std::size_t>(i)]) index.push_back(i);
    }
    Eigen::VectorXd s = Eigen::VectorXd::Zero(n);
    if (index.empty()) return s;
    const Eigen::MatrixXd part = ata(index, index);
    const Eigen::VectorXd right = atb(index);
    const Eigen::VectorXd solution = part.completeOrthogonalDecomposition().solve(right);
    s(index) = solution;
    return s;
  };
  if (last_is_free) active.back() = true;
  y = solve();
  for (Eigen::Index outer = 0; outer < 3 * n; ++outer) {
    const Eigen::VectorXd gradient = atb - ata * y;
    Eigen::Index enter = -1;
    double steepest = 1e-9 * atb.cwiseAbs().maxCoeff();
    for (Eigen::Index i = 0; i < n; ++i) {
      if (!active[static_cast<std::size_t>(i)] && gradient(i) > steepest) {
        steepest = gradient(i);
        enter = i;
      }
    }
    if (enter < 0) break;
    active[static_cast<std::size_t>(enter)] = true;
    for (Eigen::Index inner = 0; inner < n; ++inner) {
      const Eigen::VectorXd s = solve();
      double step = 1.0;
      for (Eigen::Index i = 0; i < n; ++i) {
        if (active[static_cast<std::size_t>(i)] && !unbounded(i) && s(i) <= 0.0) {
          step = std::min(step, y(i) / (y(i) - s(i)));
        }
      }
      y += step * (s - y);
      if (step >= 1.0) break;
      for (Eigen::Index i = 0; i < n; ++i) {
        if (active[static_cast<std::size_t>(i)] && !unbounded(i) && y(i) <= 1e-14) {
          active[static_cast<std::size_t>(i)] = false;
          y(i) = 0.0;
        }
      }
    }
  }
  return y;
}

/// Stretch of one element at each row.
std::vector<double> stretched(const std::vector<FrictionRow>& rows, double reach_mm) {
  std::vector<double> stretch(rows.size());
  double now = 0.0;
  for (std::size_t i = 0; i < rows.size(); ++i) {
    if (rows[i].before != FrictionRow::State::kGoesOn) now = reach_mm * state_before(rows[i], 0.0);
    now = std::clamp(now + rows[i].slide_mm, -reach_mm, reach_mm);
    stretch[i] = now;
  }
  return stretch;
}

}  // namespace

hal::Result<FrictionLawFit> fit_friction_law(const std::vector<FrictionRow>& rows,
                                             const FrictionFitOptions& options) {
  bool turned = false;
  for (std::size_t i = 1; i < rows.size() && !turned; ++i) turned = rows[i].passage != rows[0].passage;
  if (!turned) {
    return cannot_fit("the tip did not slide back and forth",
                      std::to_string(rows.size()) + " moments of sliding", "strokes both ways",
                      "stroke back and forth over the same place");
  }
  hal::Result<FrictionLawFit> fit = LawFit(rows, options).run();
  constexpr double kSigmas = 2.0;
  const bool doubtful = fit && options.doubt_viscous && fit->viscous_is_identified &&
                        fit->parameters.viscous_n_s_per_mm > 0.0 &&
                        fit->parameters.viscous_n_s_per_mm < kSigmas * fit->error.viscous_n_s_per_mm;
  if (!doubtful) return fit;
  // What cannot be distinguished from nothing only makes the level uncertain.
  FrictionFitOptions without = options;
  without.viscous = false;
  hal::Result<FrictionLawFit> simpler = LawFit(rows, without).run();
  if (!simpler) return fit;
  simpler->viscous_is_identified = true;
  simpler->error.viscous_n_s_per_mm = fit->error.viscous_n_s_per_mm;
  return simpler;
}

std::vector<double> predicted_friction_n(const std::vector<FrictionRow>& rows,
                                         const FrictionParameters& parameters, FrictionLaw law,
                                         double bias_n) {
  if (law == FrictionLaw::kDahl && parameters.maxwell_slip) {
    return predicted_friction_n(rows, {*parameters.maxwell_slip, parameters.viscous_n_s_per_mm, bias_n, 0.0});
  }
  std::vector<double> friction = built_up(rows, law, parameters.presliding_mm, parameters.exponent);
  for (std::size_t i = 0; i < rows.size(); ++i) {
    friction[i] = parameters.kinetic * rows[i].normal_n * friction[i] +
                  parameters.viscous_n_s_per_mm * rows[i].speed_mm_per_s + bias_n;
  }
  return friction;
}

hal::Result<MaxwellSlipFit> fit_maxwell_slip(const std::vector<FrictionRow>& rows,
                                             const MaxwellSlipFitOptions& options) {
  double longest_mm = 0.0;
  for (const FrictionRow& row : rows) longest_mm = std::max(longest_mm, row.path_mm);
  if (!(longest_mm > 0.0)) {
    return cannot_fit("the tip did not slide", std::to_string(rows.size()) + " moments", "strokes both ways",
                      "stroke back and forth over the same place");
  }
  const auto solve = [&](const std::vector<double>& reaches, double& left, double& squared) {
    const auto elements = static_cast<Eigen::Index>(reaches.size());
    const Eigen::Index n = elements + (options.viscous ? 1 : 0) + (options.bias ? 1 : 0);
    std::vector<std::vector<double>> stretch;
    for (const double reach_mm : reaches) stretch.push_back(stretched(rows, reach_mm));
    Eigen::MatrixXd ata = Eigen::MatrixXd::Zero(n, n);
    Eigen::VectorXd atb = Eigen::VectorXd::Zero(n);
    squared = 0.0;
    Eigen::VectorXd a(n);
    for (std::size_t i = 0; i < rows.size(); ++i) {
      if (!rows[i].settled || std::abs(rows[i].speed_mm_per_s) < options.least_speed_mm_per_s) continue;
      for (std::size_t j = 0; j < reaches.size(); ++j) {
        a(static_cast<Eigen::Index>(j)) = rows[i].normal_n * stretch[j][i];
      }
      if (options.viscous) a(elements) = rows[i].speed_mm_per_s;
      if (options.bias) a(n - 1) = 1.0;
      ata.selfadjointView<Eigen::Lower>().rankUpdate(a, rows[i].weight);
      atb += rows[i].weight * rows[i].friction_n * a;
      squared += rows[i].weight * rows[i].friction_n * rows[i].friction_n;
    }
    ata = Eigen::MatrixXd(ata.selfadjointView<Eigen::Lower>());
    Eigen::VectorXd y = non_negative(ata, atb, options.bias);
    left = std::max(0.0, squared - 2.0 * y.dot(atb) + y.dot(ata * y));
    return y;
  };

  constexpr int kLadder = 28;
  // Half a way is the longest reach that ever slips; the first step of the ladder is a hundredth of it.
  std::vector<double> reaches;
  for (int i = 0; i < kLadder; ++i) {
    reaches.push_back(0.5 * longest_mm * std::pow(100.0, static_cast<double>(i) / (kLadder - 1) - 1.0));
  }
  double left = 0.0;
  double squared = 0.0;
  Eigen::VectorXd y = solve(reaches, left, squared);
  // The few that carry most of the level, then once more.
  for (std::size_t most = MaxwellSlipParameters::kElements; true;) {
    std::vector<std::size_t> order;
    for (std::size_t j = 0; j < reaches.size(); ++j) {
      if (y(static_cast<Eigen::Index>(j)) > 0.0) order.push_back(j);
    }
    const auto level = [&](std::size_t j) { return y(static_cast<Eigen::Index>(j)) * reaches[j]; };
    std::sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) { return level(a) > level(b); });
    if (order.size() > most) order.resize(most);
    std::sort(order.begin(), order.end());
    std::vector<double> kept;
    for (const std::size_t j : order) kept.push_back(reaches[j]);
    const bool same = kept.size() == reaches.size();
    reaches = kept;
    if (reaches.empty()) break;
    if (same) break;
    y = solve(reaches, left, squared);
  }
  if (reaches.empty()) {
    return cannot_fit("friction goes along with the motion instead of against it", "", "",
                      "turn the sign of the force or of the position");
  }
  MaxwellSlipFit fit;
  for (std::size_t j = 0; j < reaches.size(); ++j) {
    fit.parameters.reach_mm[j] = reaches[j];
    fit.parameters.stiffness_per_mm[j] = y(static_cast<Eigen::Index>(j));
  }
  if (options.viscous) fit.viscous_n_s_per_mm = y(static_cast<Eigen::Index>(reaches.size()));
  if (options.bias) fit.bias_n = y(y.size() - 1);
  fit.residual = squared > 0.0 ? std::sqrt(left / squared) : 0.0;
  return fit;
}

std::vector<double> predicted_friction_n(const std::vector<FrictionRow>& rows, const MaxwellSlipFit& fit) {
  const MaxwellSlipParameters& parameters = fit.parameters;
  std::vector<double> friction(rows.size(), fit.bias_n);
  for (std::size_t i = 0; i < rows.size(); ++i)
    friction[i] += fit.viscous_n_s_per_mm * rows[i].speed_mm_per_s;
  for (std::size_t e = 0; e < parameters.reach_mm.size(); ++e) {
    if (!(parameters.reach_mm[e] > 0.0)) continue;
    const std::vector<double> stretch = stretched(rows, parameters.reach_mm[e]);
    for (std::size_t i = 0; i < rows.size(); ++i) {
      friction[i] += parameters.stiffness_per_mm[e] * rows[i].normal_n * stretch[i];
    }
  }
  return friction;
}

}  // namespace hapticd::rt
