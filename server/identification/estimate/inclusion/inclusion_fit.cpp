#include "server/identification/estimate/inclusion/inclusion_fit.h"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>

#include "rt/inclusion/inclusion_energy.h"
#include "rt/signal/vector.h"
#include "server/identification/estimate/inclusion/grouped_least_squares.h"
#include "server/linear_algebra/linear_algebra.h"

namespace hapticd::identification {

namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double kMinDisplacementMm = 0.5;  // below, the onset is in the force
constexpr std::size_t kTissueTerms = 6;
constexpr std::size_t kMinSamples = 30;
constexpr std::size_t kPoints = 200;
constexpr double kLateralWeight = 0.5;  // the surface's friction is in them, too
// Depth and n are hard to distinguish. What n can be follows from the stress of a Hertzian load of 0 … 10 mm
// radius on an incompressible half-space, σ = 3 z d dᵀ / (2π r⁵) summed over the load. Its square, averaged
// over a sphere of 2 … 12.5 mm that is 18 … 40 mm deep, falls off with n = 4.15 … 6.65 (6 for a point): taken
// are the mean of that range, and the deviation of an even distribution over it. And β: by the same stress
// the matter in a depth l moves by 4c / (π l) of the displacement, c being the radius of the load: β = 0.3 …
// 0.8.
constexpr double kUsualAttenuation = 5.4, kAttenuationDeviation = 0.72;
constexpr double kUsualApproach = 0.55, kApproachDeviation = 0.15;
constexpr double kMaxApproach = 0.9;
constexpr double kMinBodyRadiusMm = 5.0;
constexpr double kCloseMm = 0.3;  // rms of surface points off their sphere: about the precision with which an
                                  // onset is seen

/// Terms of the object's own response: smooth from zero, and a part that grows with the speed.
Eigen::Matrix<double, kTissueTerms, 1> tissue_terms(double x, double rate) {
  Eigen::Matrix<double, kTissueTerms, 1> terms;
  terms << x, x * std::sqrt(x), x * x, x * x * x / 10.0, rate * x / 100.0, rate * x * x / 1000.0;
  return terms;
}

/// One sample as the fits see it.
struct Row {
  rt::Indentation at;
  double normal_n = 0.0;
  hal::Vector3 lateral_n;
  std::size_t press = 0;
  bool has_inclusion = false;
};

struct Sphere {
  hal::Vector3 centre_mm;
  double radius_mm = 0.0;
  bool is_close = false;  ///< to the surface points
  hal::Vector3 normal_at(const hal::Vector3& p) const {
    return rt::direction_or(p - centre_mm, {0.0, 0.0, 1.0});
  }
};

/// Fits a sphere through the surface points, by linear least squares; a plane counts as a sphere of 1 m.
Sphere surface_of(const std::vector<Press>& presses) {
  hal::Vector3 mean;
  for (const Press& p : presses) mean = mean + p.surface_mm * (1.0 / static_cast<double>(presses.size()));
  constexpr double kMaxMm = 1000.0;
  const Sphere flat{mean - hal::Vector3{0.0, 0.0, kMaxMm}, kMaxMm};
  if (presses.size() < 6) return flat;
  MatrixXd a(static_cast<Eigen::Index>(presses.size()), 4);
  VectorXd b(a.rows());
  for (Eigen::Index i = 0; i < a.rows(); ++i) {
    const hal::Vector3 p = presses[static_cast<std::size_t>(i)].surface_mm - mean;
    a.row(i) << 2.0 * p.x, 2.0 * p.y, 2.0 * p.z, 1.0;
    b[i] = dot(p, p);
  }
  const VectorXd c = linear_algebra::solve_least_squares(a, b);
  const double squared = c[3] + c.head<3>().squaredNorm();
  if (!c.allFinite() || !(squared > 0.0 && squared < kMaxMm * kMaxMm) || !(c[2] < 0.0)) return flat;
  Sphere sphere{mean + hal::Vector3{c[0], c[1], c[2]}, std::sqrt(squared)};
  double off = 0.0;
  for (const Press& p : presses) {
    const double off_mm = rt::norm(p.surface_mm - sphere.centre_mm) - sphere.radius_mm;
    off += off_mm * off_mm;
  }
  sphere.is_close = off < kCloseMm * kCloseMm * static_cast<double>(presses.size());
  return sphere;
}

void add_rows(const std::vector<Press>& presses, const Sphere& surface, bool has_inclusion,
              std::vector<Row>& rows) {
  for (const Press& press : presses) {
    const std::size_t number = rows.empty() ? 0 : rows.back().press + 1;
    const double from_mm =
        surface.is_close ? surface.radius_mm : rt::norm(press.surface_mm - surface.centre_mm);
    for (const PressSample& s : press.samples) {
      Row row;
      row.at.tip_mm = s.tip_mm;
      row.at.normal = surface.normal_at(s.tip_mm);
      row.at.displacement_mm = from_mm - rt::norm(s.tip_mm - surface.centre_mm);
      row.at.rate_mm_per_s = -dot(s.velocity_mm_per_s, row.at.normal);
      if (row.at.displacement_mm < kMinDisplacementMm) continue;
      row.normal_n = dot(s.force_n, row.at.normal);
      row.lateral_n = rt::across(s.force_n, row.at.normal);
      row.press = number;
      row.has_inclusion = has_inclusion;
      rows.push_back(row);
    }
  }
}

/// Adds the object's own law as samples without the inclusion, at the displacements and speeds of the others.
void add_law_rows(const rt::HuntCrossleyParameters& law, std::size_t count, std::vector<Row>& rows) {
  const std::size_t first = rows.empty() ? 0 : rows.back().press + 1;
  for (std::size_t i = 0; i < count; ++i) {
    Row row = rows[i];
    row.normal_n = rt::hunt_crossley_force_n(law, row.at.displacement_mm, row.at.rate_mm_per_s);
    row.press += first;
    row.has_inclusion = false;
    rows.push_back(row);
  }
}

hal::Error too_little(const char* what) {
  return {std::string("too few samples: ") + what, "identification of an inclusion", "",
          "at least " + std::to_string(kMinSamples), "press deeper, or more often"};
}

void note_range(const std::vector<Row>& rows, InclusionFit& fit) {
  for (const Row& row : rows) {
    if (!row.has_inclusion) continue;
    fit.max_displacement_mm = std::max(fit.max_displacement_mm, row.at.displacement_mm);
    fit.max_speed_mm_per_s = std::max(fit.max_speed_mm_per_s, std::abs(row.at.rate_mm_per_s));
    fit.max_force_n = std::max(fit.max_force_n, row.normal_n);
  }
  fit.inclusion.max_displacement_mm = std::max(0.5, fit.max_displacement_mm);
}

VectorXd tissue_response(const std::vector<Row>& rows) {
  MatrixXd a(static_cast<Eigen::Index>(rows.size()), static_cast<Eigen::Index>(kTissueTerms));
  VectorXd b(a.rows());
  for (Eigen::Index i = 0; i < a.rows(); ++i) {
    const Row& row = rows[static_cast<std::size_t>(i)];
    a.row(i) = tissue_terms(row.at.displacement_mm, row.at.rate_mm_per_s).transpose();
    b[i] = row.normal_n;
  }
  return linear_algebra::solve_least_squares(a, b);
}

/// Root mean square of what the object's own response leaves, as the fit of a scan weighs it.
double rms_without_inclusion(const std::vector<Row>& rows) {
  const VectorXd own = tissue_response(rows);
  double squared = 0.0;
  for (const Row& row : rows) {
    const double left = tissue_terms(row.at.displacement_mm, row.at.rate_mm_per_s).dot(own) - row.normal_n;
    squared += left * left;
    if (row.has_inclusion) squared += kLateralWeight * kLateralWeight * dot(row.lateral_n, row.lateral_n);
  }
  return std::sqrt(squared / (3.0 * static_cast<double>(rows.size())));
}

}  // namespace

hal::Result<InclusionFit> fit_inclusion_response(const std::vector<Press>& without,
                                                 const std::vector<Press>& with, double depth_mm,
                                                 const std::optional<rt::HuntCrossleyParameters>& law) {
  const Sphere flat = surface_of({});
  const auto flat_for = [&](const std::vector<Press>& presses) {
    Sphere s = flat;
    hal::Vector3 mean;
    for (const Press& p : presses) mean = mean + p.surface_mm * (1.0 / static_cast<double>(presses.size()));
    s.centre_mm = mean - hal::Vector3{0.0, 0.0, 1e5};
    s.radius_mm = 1e5;
    return s;
  };
  std::vector<Row> own, rows;
  add_rows(without, flat_for(without), false, own);
  add_rows(with, flat_for(with), true, rows);
  if (rows.size() < kMinSamples) return too_little("with the inclusion");
  if (law) {
    const auto count = static_cast<std::ptrdiff_t>(rows.size());
    std::vector<Row> both = rows;
    add_law_rows(*law, rows.size(), both);
    own.assign(both.begin() + count, both.end());
  }
  if (own.size() < kMinSamples) return too_little("without the inclusion");
  const VectorXd tissue = tissue_response(own);
  std::vector<std::size_t> groups;
  VectorXd excess(static_cast<Eigen::Index>(rows.size()));
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const rt::Indentation& at = rows[i].at;
    excess[static_cast<Eigen::Index>(i)] =
        rows[i].normal_n - tissue_terms(at.displacement_mm, at.rate_mm_per_s).dot(tissue);
    groups.push_back(rows[i].press);
  }
  // p = ln K at 5 mm, B/K, m.
  const auto residuals = [&](const VectorXd& p) {
    VectorXd r(excess.size());
    for (std::size_t i = 0; i < rows.size(); ++i) {
      const rt::Indentation& at = rows[i].at;
      r[static_cast<Eigen::Index>(i)] =
          std::exp(p[0]) * std::pow(at.displacement_mm / 5.0, p[2]) * (1.0 + p[1] * at.rate_mm_per_s) -
          excess[static_cast<Eigen::Index>(i)];
    }
    return r;
  };
  VectorXd p(3), steps(3), low(3), high(3);
  p << 0.0, 0.0, 1.8;
  steps << 1e-4, 1e-6, 1e-4;
  low << -12.0, 0.0, 1.0;
  high << 5.0, 0.02, 4.0;
  const LeastSquaresSolution s = grouped_least_squares(residuals, p, steps, low, high, groups);

  InclusionFit fit;
  const double k = std::exp(s.parameters[0]) * std::pow(5.0, -s.parameters[2]);
  fit.inclusion.response = {k, k * s.parameters[1], s.parameters[2]};
  fit.stiffness_n_per_mm_m = {k, k * std::hypot(s.standard_errors[0], std::log(5.0) * s.standard_errors[2])};
  fit.added_at_5mm_n = {std::exp(s.parameters[0]), std::exp(s.parameters[0]) * s.standard_errors[0]};
  fit.own_at_5mm_n = tissue_terms(5.0, 0.0).dot(tissue);
  fit.damping_n_s_per_mm_m1 = {k * s.parameters[1], k * s.standard_errors[1]};
  fit.exponent = {s.parameters[2], s.standard_errors[2]};
  for (const Press& press : with)
    fit.inclusion.surface_mm =
        fit.inclusion.surface_mm + press.surface_mm * (1.0 / static_cast<double>(with.size()));
  fit.inclusion.place_mm = fit.inclusion.surface_mm - hal::Vector3{0.0, 0.0, depth_mm};
  fit.place_mm = fit.inclusion.place_mm;
  fit.residual = s.rms / std::max(1e-9, std::sqrt(excess.squaredNorm() / static_cast<double>(excess.size())));
  fit.converged = s.converged;
  note_range(rows, fit);
  const std::size_t stride = rows.size() / kPoints + 1;
  for (std::size_t i = 0; i < rows.size(); i += stride) {
    const rt::Indentation& at = rows[i].at;
    const double own_n = tissue_terms(at.displacement_mm, at.rate_mm_per_s).dot(tissue);
    fit.points.push_back(
        {at.displacement_mm, rows[i].normal_n,
         own_n + rt::hunt_crossley_force_n(fit.inclusion.response, at.displacement_mm, at.rate_mm_per_s)});
  }
  return fit;
}

hal::Result<InclusionFit> fit_inclusion_scan(const std::vector<Press>& without,
                                             const std::vector<Press>& with,
                                             const std::optional<rt::HuntCrossleyParameters>& own,
                                             const Estimated& tip_radius_mm) {
  std::vector<Press> all = with;
  all.insert(all.end(), without.begin(), without.end());
  constexpr std::size_t kEnoughToSpan = 6;
  const Sphere surface = surface_of(without.size() >= kEnoughToSpan ? without : all);
  std::vector<Row> rows;
  add_rows(with, surface, true, rows);
  const std::size_t with_count = rows.size();
  add_rows(without, surface, false, rows);
  if (with_count < kMinSamples) return too_little("with the inclusion");
  if (own) add_law_rows(*own, with_count, rows);

  // Begins the search at the place whose force most exceeds that of the other presses at the same
  // displacement.
  const VectorXd rough = tissue_response(
      rows.size() == with_count
          ? rows
          : std::vector<Row>(rows.begin() + static_cast<std::ptrdiff_t>(with_count), rows.end()));
  hal::Vector3 sum;
  double weight = 0.0;
  for (std::size_t i = 0; i < with_count; ++i) {
    const rt::Indentation& at = rows[i].at;
    const double more = rows[i].normal_n - tissue_terms(at.displacement_mm, at.rate_mm_per_s).dot(rough);
    if (!(more > 0.0)) continue;
    sum = sum + at.tip_mm * (more * more);
    weight += more * more;
  }
  if (!(weight > 0.0)) return too_little("that exceed the object's own response");
  const hal::Vector3 start = sum * (1.0 / weight);

  // A ball touches a round body nearer to the body's middle than its lowest point is: places of the tip are
  // farther apart by the ratio of the two radii, and so is the depth that follows from them. Rendering works
  // with places of the tip, too.
  const double body_radius_mm = std::max(kMinBodyRadiusMm, surface.radius_mm - tip_radius_mm.value);
  const double widening = std::max(1.0, surface.radius_mm / body_radius_mm);

  // p: x, y of the surface over it, its depth in the body, ln of the response at 5 mm, B/K, m, n, β, and the
  // object's own response.
  constexpr Eigen::Index kOwn = 8;
  const auto inclusion_of = [&](const VectorXd& p) {
    rt::InclusionParameters inclusion;
    const double dx = p[0] - surface.centre_mm.x, dy = p[1] - surface.centre_mm.y;
    const double up = std::sqrt(std::max(1.0, surface.radius_mm * surface.radius_mm - dx * dx - dy * dy));
    // (x, y) is that of the surface point; the centre is below it along the normal.
    inclusion.surface_mm = surface.centre_mm + hal::Vector3{dx, dy, up};
    inclusion.place_mm = inclusion.surface_mm - surface.normal_at(inclusion.surface_mm) * (widening * p[2]);
    const double k = std::exp(p[3]) * std::pow(5.0, -p[5]);
    inclusion.response = {k, k * p[4], p[5]};
    inclusion.attenuation = p[6];
    inclusion.approach = widening * p[7];
    inclusion.max_displacement_mm = 1e3;
    return inclusion;
  };
  const auto residuals = [&](const VectorXd& p) {
    VectorXd r(static_cast<Eigen::Index>(3 * rows.size()));
    const rt::InclusionParameters inclusion = inclusion_of(p);
    for (std::size_t i = 0; i < rows.size(); ++i) {
      const Row& row = rows[i];
      double normal_n =
          tissue_terms(row.at.displacement_mm, row.at.rate_mm_per_s).dot(p.segment<kTissueTerms>(kOwn));
      double side_x = 0.0, side_y = 0.0;
      if (row.has_inclusion) {
        const hal::Vector3 added = rt::energy_force_n(inclusion, row.at);
        normal_n += dot(added, row.at.normal);
        const hal::Vector3 side = rt::across(added, row.at.normal) - row.lateral_n;
        side_x = side.x;
        side_y = side.y;
      }
      const auto at = static_cast<Eigen::Index>(3 * i);
      r[at] = normal_n - row.normal_n;
      r[at + 1] = kLateralWeight * side_x;
      r[at + 2] = kLateralWeight * side_y;
    }
    return r;
  };
  std::vector<std::size_t> groups;
  for (const Row& row : rows) groups.insert(groups.end(), 3, row.press);
  const std::vector<PriorKnowledge> priors{{6, kUsualAttenuation, kAttenuationDeviation},
                                           {7, kUsualApproach, kApproachDeviation}};
  VectorXd p(kOwn + static_cast<Eigen::Index>(kTissueTerms)), steps(p.size()), low(p.size()), high(p.size());
  steps.setConstant(1e-4);
  low.setConstant(-1e3);
  high.setConstant(1e3);
  low.head<kOwn>() << start.x - 30.0, start.y - 30.0, 8.0, -12.0, 0.0, 1.0, 2.0, 0.0;
  high.head<kOwn>() << start.x + 30.0, start.y + 30.0, 60.0, 5.0, 0.02, 4.0, 12.0, kMaxApproach / widening;
  LeastSquaresSolution best;
  best.rms = 1e9;
  for (const double depth_mm : {15.0, 25.0, 35.0}) {
    p.head<kOwn>() << start.x, start.y, depth_mm, 0.0, 1e-4, 1.8, kUsualAttenuation, kUsualApproach;
    p.tail<kTissueTerms>() = rough;
    const LeastSquaresSolution one = grouped_least_squares(residuals, p, steps, low, high, groups, priors, 3);
    if (one.rms < best.rms) best = one;
  }

  InclusionFit fit;
  fit.inclusion = inclusion_of(best.parameters);
  const VectorXd& e = best.standard_errors;
  // In the body, along the normal below where the ball touches it; the depth's error adds to that of a place
  // off the top.
  const hal::Vector3 normal = surface.normal_at(fit.inclusion.surface_mm);
  const double below_mm = body_radius_mm - best.parameters[2];
  fit.place_mm = surface.centre_mm + hal::Vector3{0.0, 0.0, tip_radius_mm.value} + normal * below_mm;
  const auto across_error_mm = [&](Eigen::Index i, double part) {
    const double by_surface = below_mm / surface.radius_mm;
    const double squared = by_surface * by_surface * best.covariance(i, i) +
                           part * part * best.covariance(2, 2) -
                           2.0 * by_surface * part * best.covariance(i, 2);
    return std::sqrt(std::max(0.0, squared));
  };
  fit.place_x_mm = {fit.place_mm.x, across_error_mm(0, normal.x)};
  fit.place_y_mm = {fit.place_mm.y, across_error_mm(1, normal.y)};
  // A ball with another radius changes the widening alone.
  const double by_radius = best.parameters[2] * widening / surface.radius_mm;
  fit.depth_mm = {best.parameters[2], std::hypot(e[2], by_radius * tip_radius_mm.standard_error)};
  const double k = fit.inclusion.response.stiffness_n_per_mm_m;
  fit.stiffness_n_per_mm_m = {k, k * std::hypot(e[3], std::log(5.0) * e[5])};
  fit.added_at_5mm_n = {std::exp(best.parameters[3]), std::exp(best.parameters[3]) * e[3]};
  fit.own_at_5mm_n = tissue_terms(5.0, 0.0).dot(best.parameters.segment<kTissueTerms>(kOwn));
  fit.damping_n_s_per_mm_m1 = {k * best.parameters[4], k * e[4]};
  fit.exponent = {best.parameters[5], e[5]};
  fit.attenuation = {fit.inclusion.attenuation, e[6]};
  fit.approach = {fit.inclusion.approach, widening * e[7]};
  double added = 0.0;
  const std::size_t stride = with_count / kPoints + 1;
  for (std::size_t i = 0; i < with_count; ++i) {
    const rt::Indentation& at = rows[i].at;
    const hal::Vector3 f = rt::energy_force_n(fit.inclusion, at);
    added += dot(f, f);
    if (i % stride != 0) continue;
    const double own_n =
        tissue_terms(at.displacement_mm, at.rate_mm_per_s).dot(best.parameters.segment<kTissueTerms>(kOwn));
    fit.points.push_back({at.displacement_mm, rows[i].normal_n, own_n + dot(f, at.normal)});
  }
  fit.residual = best.rms * std::sqrt(3.0 * static_cast<double>(rows.size()) / std::max(1e-9, added));
  fit.left_over_share = best.rms / std::max(1e-9, rms_without_inclusion(rows));
  const auto bounded = [&](Eigen::Index i, double margin) {
    return best.parameters[i] < low[i] + margin || best.parameters[i] > high[i] - margin;
  };
  fit.at_bound = bounded(0, 0.5) || bounded(1, 0.5) || bounded(2, 0.5);
  fit.converged = best.converged;
  note_range(rows, fit);
  return fit;
}

}  // namespace hapticd::identification
