#include "server/identification/estimate/contact/surface_spline.h"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <limits>

#include "server/linear_algebra/linear_algebra.h"

namespace hapticd::identification {

namespace {

constexpr std::size_t kMinPlaces = 5;
constexpr double kSamePlaceMm = 1e-3;

hal::Error cannot(const std::string& what, std::size_t points, const std::string& limit,
                  const std::string& remedy) {
  return {what, "surface scan", std::to_string(points) + " points", limit, remedy};
}

/// Linear forms of a spline at one place in heights (a, b) and bends (c, d) of the knots on either side.
struct Forms {
  std::size_t left = 0;
  double value[4];
  double slope[4];
};

Forms forms_at(const std::vector<double>& s, double at) {
  Forms f;
  const auto after = std::upper_bound(s.begin() + 1, s.end() - 1, at);
  f.left = static_cast<std::size_t>(after - s.begin()) - 1;
  const double h = s[f.left + 1] - s[f.left];
  // Beyond the ends it goes on straight.
  const double inside = std::clamp(at, s.front(), s.back());
  const double beyond = at - inside;
  const double u = (inside - s[f.left]) / h;
  const double w = 1.0 - u;
  f.slope[0] = -1.0 / h;
  f.slope[1] = 1.0 / h;
  f.slope[2] = -h / 6.0 * (3.0 * w * w - 1.0);
  f.slope[3] = h / 6.0 * (3.0 * u * u - 1.0);
  f.value[0] = w;
  f.value[1] = u;
  f.value[2] = h * h / 6.0 * (w * w * w - w);
  f.value[3] = h * h / 6.0 * (u * u * u - u);
  for (int i = 0; i < 4; ++i) f.value[i] += beyond * f.slope[i];
  return f;
}

/// Variance of single heights as fourth divided differences show it, to which a cubic adds nothing.
double scatter_mm2(const std::vector<double>& s, const std::vector<double>& heights,
                   const std::vector<double>& together) {
  constexpr std::size_t kPoints = 5;
  double sum = 0.0;
  double count = 0.0;
  for (std::size_t i = 0; i + kPoints <= s.size(); ++i) {
    double difference = 0.0;
    double variance = 0.0;
    for (std::size_t j = i; j < i + kPoints; ++j) {
      double factor = 1.0;
      for (std::size_t k = i; k < i + kPoints; ++k) {
        if (k != j) factor /= s[j] - s[k];
      }
      difference += factor * heights[j];
      variance += factor * factor / together[j];
    }
    sum += difference * difference / variance;
    count += 1.0;
  }
  return count > 0.0 ? sum / count : 0.0;
}

}  // namespace

hal::Result<SurfaceSpline> SurfaceSpline::fit(std::vector<ProfilePoint> points, double min_error_mm) {
  for (const ProfilePoint& p : points) {
    if (!std::isfinite(p.along_mm) || !std::isfinite(p.height_mm)) {
      return cannot("a touched point is not finite", points.size(), "finite coordinates", "leave it out");
    }
  }
  std::sort(points.begin(), points.end(),
            [](const ProfilePoint& a, const ProfilePoint& b) { return a.along_mm < b.along_mm; });
  SurfaceSpline spline;
  std::vector<double> together;
  std::vector<double> heights;
  for (const ProfilePoint& p : points) {
    if (!spline.along_mm_.empty() && p.along_mm - spline.along_mm_.back() < kSamePlaceMm) {
      together.back() += 1.0;
      heights.back() += (p.height_mm - heights.back()) / together.back();
      continue;
    }
    spline.along_mm_.push_back(p.along_mm);
    heights.push_back(p.height_mm);
    together.push_back(1.0);
  }
  const std::size_t places = heights.size();
  if (places < kMinPlaces) {
    return cannot("too few places were touched to determine the surface", points.size(),
                  "at least " + std::to_string(kMinPlaces) + " places", "touch more places along the line");
  }
  if (places > kMaxPoints) {
    return cannot("too many places for one profile", points.size(), "at most " + std::to_string(kMaxPoints),
                  "thin them out");
  }

  // The parabola, its square made orthogonal to straight lines.
  const auto n = static_cast<Eigen::Index>(places);
  const Eigen::Map<const Eigen::VectorXd> at(spline.along_mm_.data(), n);
  const Eigen::Map<const Eigen::VectorXd> weights(together.data(), n);
  spline.centre_mm_ = weights.dot(at) / weights.sum();
  Eigen::MatrixXd lines(n, 2);
  lines.col(0).setOnes();
  lines.col(1) = at.array() - spline.centre_mm_;
  const Eigen::VectorXd square = 0.5 * lines.col(1).array().square();
  const Eigen::MatrixXd weighted = weights.asDiagonal() * lines;
  const Eigen::Matrix2d gram = lines.transpose() * weighted;
  const Eigen::VectorXd bow =
      square - lines * linear_algebra::solve_symmetric(gram, weighted.transpose() * square);
  const double bow_squared = bow.dot(weights.cwiseProduct(bow));
  const double scattered_mm2 = scatter_mm2(spline.along_mm_, heights, together);
  Eigen::Map<Eigen::VectorXd> remaining(heights.data(), n);
  spline.curvature_per_mm_ = bow.dot(weights.cwiseProduct(remaining)) / bow_squared;
  spline.spread_mm2_ = 2.0 * weights.dot(square) / weights.sum();
  remaining -= spline.curvature_per_mm_ * square;

  // Green and Silverman 1994: ∫ g''² = hᵀ K h with K = Q R⁻¹ Qᵀ, and bends inside = R⁻¹ Qᵀ h.
  Eigen::MatrixXd q = Eigen::MatrixXd::Zero(n, n - 2);
  Eigen::MatrixXd r = Eigen::MatrixXd::Zero(n - 2, n - 2);
  const auto gap = [&](Eigen::Index i) {
    return spline.along_mm_[static_cast<std::size_t>(i) + 1] - spline.along_mm_[static_cast<std::size_t>(i)];
  };
  for (Eigen::Index j = 0; j < n - 2; ++j) {
    const double before = gap(j);
    const double after = gap(j + 1);
    q(j, j) = 1.0 / before;
    q(j + 1, j) = -1.0 / before - 1.0 / after;
    q(j + 2, j) = 1.0 / after;
    r(j, j) = (before + after) / 3.0;
    if (j + 1 < n - 2) r(j, j + 1) = r(j + 1, j) = after / 6.0;
  }
  const Eigen::MatrixXd bend_of_height = linear_algebra::solve_symmetric_columns(r, q.transpose());
  const Eigen::MatrixXd roughness = q * bend_of_height;
  // Repeated places weigh more: in the coordinates √w h the noise is white again.
  const Eigen::VectorXd weight = Eigen::Map<const Eigen::VectorXd>(together.data(), n);
  const Eigen::VectorXd root = weight.cwiseSqrt();
  const Eigen::MatrixXd scaled =
      root.cwiseInverse().asDiagonal() * roughness * root.cwiseInverse().asDiagonal();
  const linear_algebra::SymmetricEigen modes =
      linear_algebra::symmetric_eigen(0.5 * (scaled + scaled.transpose()));
  const Eigen::VectorXd y = Eigen::Map<const Eigen::VectorXd>(heights.data(), n);
  const Eigen::VectorXd amplitude = modes.vectors.transpose() * root.cwiseProduct(y);
  // The two smallest modes are the straight lines, which cost nothing.
  const auto noise_mm2 = [&](double lambda) {
    double sum = 0.0;
    for (Eigen::Index i = 2; i < n; ++i) {
      const double ld = lambda * modes.values(i);
      sum += amplitude(i) * amplitude(i) * ld / (1.0 + ld);
    }
    return sum / static_cast<double>(n - 2);
  };
  // A spline that may be as rough as it likes takes noise for roughness; what cubics leave is surely noise.
  const double min_mm2 = std::max({min_error_mm * min_error_mm, scattered_mm2, 1e-12});
  double best_lambda = 0.0;
  double best = std::numeric_limits<double>::infinity();
  const double scale = std::max(modes.values(n - 1), 1e-300);
  for (double log_lambda = -6.0; log_lambda <= 10.0; log_lambda += 0.1) {
    const double lambda = std::pow(10.0, log_lambda) / scale;
    // Profiled over the noise; a noise below what the heights were measured to is not believed.
    const double profiled = std::max(noise_mm2(lambda), min_mm2);
    double deviance = static_cast<double>(n - 2) * std::log(profiled) +
                      static_cast<double>(n - 2) * noise_mm2(lambda) / profiled;
    for (Eigen::Index i = 2; i < n; ++i) {
      const double ld = lambda * modes.values(i);
      deviance -= std::log(ld / (1.0 + ld));
    }
    if (deviance < best) {
      best = deviance;
      best_lambda = lambda;
    }
  }
  const double variance = std::max(noise_mm2(best_lambda), min_mm2);
  spline.point_error_mm_ = std::sqrt(variance);
  spline.curvature_error_per_mm_ = std::sqrt(variance / bow_squared);

  Eigen::VectorXd shrink(n);
  for (Eigen::Index i = 0; i < n; ++i) {
    shrink(i) = 1.0 / (1.0 + best_lambda * (i < 2 ? 0.0 : modes.values(i)));
  }
  const Eigen::MatrixXd basis = root.cwiseInverse().asDiagonal() * modes.vectors;
  const Eigen::VectorXd height = basis * shrink.cwiseProduct(amplitude);
  const Eigen::MatrixXd covariance = variance * basis * shrink.asDiagonal() * basis.transpose();
  const Eigen::VectorXd bend = bend_of_height * height;

  spline.height_mm_.assign(height.data(), height.data() + n);
  spline.bend_per_mm_.assign(places, 0.0);
  spline.bend_of_height_.assign(places * places, 0.0);
  spline.covariance_mm2_.assign(places * places, 0.0);
  for (Eigen::Index i = 0; i < n; ++i) {
    const auto row = static_cast<std::size_t>(i) * places;
    const bool inner = i > 0 && i + 1 < n;
    if (inner) spline.bend_per_mm_[static_cast<std::size_t>(i)] = bend(i - 1);
    for (Eigen::Index j = 0; j < n; ++j) {
      spline.covariance_mm2_[row + static_cast<std::size_t>(j)] = covariance(i, j);
      if (inner) spline.bend_of_height_[row + static_cast<std::size_t>(j)] = bend_of_height(i - 1, j);
    }
  }
  return spline;
}

ProfileValue SurfaceSpline::at(double along_mm) const {
  const Forms f = forms_at(along_mm_, along_mm);
  const std::size_t l = f.left;
  const std::size_t n = along_mm_.size();
  const auto apply = [&](const double(&form)[4]) {
    return form[0] * height_mm_[l] + form[1] * height_mm_[l + 1] + form[2] * bend_per_mm_[l] +
           form[3] * bend_per_mm_[l + 1];
  };
  const auto error = [&](const double(&form)[4]) {
    Eigen::VectorXd g(static_cast<Eigen::Index>(n));
    for (std::size_t j = 0; j < n; ++j) {
      g(static_cast<Eigen::Index>(j)) =
          form[2] * bend_of_height_[l * n + j] + form[3] * bend_of_height_[(l + 1) * n + j];
    }
    g(static_cast<Eigen::Index>(l)) += form[0];
    g(static_cast<Eigen::Index>(l) + 1) += form[1];
    const auto size = static_cast<Eigen::Index>(n);
    const Eigen::Map<const Eigen::MatrixXd> covariance(covariance_mm2_.data(), size, size);
    return std::sqrt(std::max(0.0, g.dot(covariance * g)));
  };
  ProfileValue value{apply(f.value), apply(f.slope), error(f.value), error(f.slope)};
  double slope = 0.0;
  value.height_mm += parabola(along_mm, slope);
  value.slope += slope;
  const double from_centre_mm = along_mm - centre_mm_;
  const double bow_mm2 = 0.5 * (from_centre_mm * from_centre_mm - spread_mm2_);
  value.height_error_mm = std::hypot(value.height_error_mm, curvature_error_per_mm_ * bow_mm2);
  value.slope_error = std::hypot(value.slope_error, curvature_error_per_mm_ * from_centre_mm);
  return value;
}

double SurfaceSpline::parabola(double along_mm, double& slope) const {
  const double from_centre_mm = along_mm - centre_mm_;
  slope = curvature_per_mm_ * from_centre_mm;
  return 0.5 * slope * from_centre_mm;
}

double SurfaceSpline::nearest_along_mm(double along_mm, double height_mm) const {
  // Newton's method with the curvature of the profile left out: it converges as long as the point is nearer
  // than the radius of the surface, and slowly at worst.
  double s = along_mm;
  for (int i = 0; i < 12; ++i) {
    const Forms f = forms_at(along_mm_, s);
    const std::size_t l = f.left;
    const auto apply = [&](const double(&form)[4]) {
      return form[0] * height_mm_[l] + form[1] * height_mm_[l + 1] + form[2] * bend_per_mm_[l] +
             form[3] * bend_per_mm_[l + 1];
    };
    double slope = 0.0;
    const double height = parabola(s, slope) + apply(f.value);
    slope += apply(f.slope);
    const double step = ((along_mm - s) + slope * (height_mm - height)) / (1.0 + slope * slope);
    s += step;
    if (std::abs(step) < 1e-6) break;
  }
  return s;
}

}  // namespace hapticd::identification
