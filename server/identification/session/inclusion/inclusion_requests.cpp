#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "rt/signal/vector.h"
#include "server/identification/session/fixed_text.h"
#include "server/identification/session/inclusion/inclusion_identification.h"
#include "server/linear_algebra/linear_algebra.h"

namespace hapticd::identification {

namespace {

constexpr double kInclusionHoldS = 0.3;
constexpr double kPressMmPerS = 60.0;
constexpr double kEnoughDepth = 0.6;  // of what is asked for
constexpr double kMaxPlaces = 15.0;   // along one axis
constexpr std::size_t kPressesOver = 6;

double depth_of(const Press& press) {
  double deepest = 0.0;
  for (const PressSample& s : press.samples) {
    deepest = std::max(deepest, rt::norm(s.tip_mm - press.surface_mm));
  }
  return deepest;
}

}  // namespace

hal::Vector3 InclusionIdentification::centre_mm() const {
  const std::vector<Press>& presses = collector_.presses();
  if (presses.empty()) return {};
  if (!replay_) return {presses.front().surface_mm.x, presses.front().surface_mm.y, 0.0};
  hal::Vector3 mean;
  for (const Press& p : presses) mean = mean + p.surface_mm * (1.0 / static_cast<double>(presses.size()));
  return {mean.x, mean.y, 0.0};
}

Coverage InclusionIdentification::grid() const {
  const hal::Vector3 centre = centre_mm();
  double reach_mm = scans() ? task_.reach_mm : 0.0;
  if (replay_) {
    for (const Press& p : collector_.presses()) {
      const hal::Vector3 off = p.surface_mm - centre;
      reach_mm = std::max({reach_mm, std::abs(off.x), std::abs(off.y)});
    }
  }
  const double each_side = std::min(std::floor(reach_mm / task_.spacing_mm + 1e-9), (kMaxPlaces - 1.0) / 2.0);
  const int bins = 2 * static_cast<int>(each_side) + 1;
  const double half_mm = (each_side + 0.5) * task_.spacing_mm;
  const std::string from = replay_ ? " from the middle" : " from the first press";
  Coverage coverage({"x" + from, "mm", -half_mm, half_mm, bins}, {"y" + from, "mm", -half_mm, half_mm, bins});
  coverage.enough_samples = scans() ? 1 : static_cast<std::uint32_t>(kPressesOver);
  for (const Press& p : collector_.presses()) {
    if (!replay_ && depth_of(p) < kEnoughDepth * task_.displacement_mm) continue;
    const double column = std::floor((p.surface_mm.x - centre.x + half_mm) / task_.spacing_mm);
    const double row = std::floor((p.surface_mm.y - centre.y + half_mm) / task_.spacing_mm);
    if (!(column >= 0.0 && column < bins && row >= 0.0 && row < bins)) continue;
    ++coverage.counts[coverage.cell(static_cast<int>(column), static_cast<int>(row))];
  }
  for (int j = 0; j < bins && !replay_; ++j) {
    for (int i = 0; i < bins; ++i) {
      const double from_centre_mm = task_.spacing_mm * std::hypot(i - each_side, j - each_side);
      if (from_centre_mm <= reach_mm + 1e-9) coverage.required[coverage.cell(i, j)] = 1;
    }
  }
  coverage.update_share();
  return coverage;
}

std::optional<hal::Vector3> InclusionIdentification::open_place_mm() const {
  if (replay_) return std::nullopt;
  const Coverage map = grid();
  std::optional<hal::Vector3> nearest;
  for (std::size_t cell = 0; cell < map.counts.size(); ++cell) {
    if (map.has_enough(cell)) continue;
    const auto column = static_cast<double>(cell % static_cast<std::size_t>(map.x.bins));
    const auto row = static_cast<double>(cell / static_cast<std::size_t>(map.x.bins));
    const hal::Vector3 place{map.x.from + (column + 0.5) * task_.spacing_mm,
                             map.y.from + (row + 0.5) * task_.spacing_mm, 0.0};
    if (!nearest || rt::norm(place) < rt::norm(*nearest) - 1e-9) nearest = place;
  }
  return nearest;
}

double InclusionIdentification::surface_height_mm(double x_mm, double y_mm) const {
  // z = a + b x + c y + d (x² + y²) through where the surface was met; a plane or less if there are few
  // presses.
  const std::vector<Press>& presses = collector_.presses();
  if (presses.empty()) return 0.0;
  const hal::Vector3 centre = centre_mm();
  const Eigen::Index terms = presses.size() >= 8 ? 4 : 1;
  if (terms == 1) {
    const Press* nearest = &presses.front();
    const auto away = [&](const Press& p) {
      return std::hypot(p.surface_mm.x - centre.x - x_mm, p.surface_mm.y - centre.y - y_mm);
    };
    for (const Press& p : presses) {
      if (away(p) < away(*nearest)) nearest = &p;
    }
    return nearest->surface_mm.z;
  }
  Eigen::MatrixXd a(static_cast<Eigen::Index>(presses.size()), terms);
  Eigen::VectorXd b(a.rows());
  for (Eigen::Index i = 0; i < a.rows(); ++i) {
    const hal::Vector3& p = presses[static_cast<std::size_t>(i)].surface_mm;
    const double x = p.x - centre.x, y = p.y - centre.y;
    a.row(i) << 1.0, x, y, x * x + y * y;
    b[i] = p.z;
  }
  const Eigen::VectorXd c = linear_algebra::solve_least_squares(a, b);
  return c[0] + c[1] * x_mm + c[2] * y_mm + c[3] * (x_mm * x_mm + y_mm * y_mm);
}

MotionRequest InclusionIdentification::press_at(double x_mm, double y_mm, double speed_mm_per_s) const {
  MotionRequest request;
  request.motion = MotionRequest::Motion::kPress;
  request.place_mm = {x_mm, y_mm, surface_height_mm(x_mm, y_mm)};
  request.displacement_mm = task_.displacement_mm;
  request.speed_mm_per_s = speed_mm_per_s;
  request.hold_s = kInclusionHoldS;
  const bool first = collector_.presses().empty();
  request.words =
      first
          ? formatted("press straight down, about %.0f mm deep, %s, and let go", task_.displacement_mm,
                      scans() ? "in the middle of where the inclusion may be" : "straight over the inclusion")
          : formatted(
                "press straight down, about %.0f mm deep, at x = %.0f mm, y = %.0f mm from the first "
                "press, and let go",
                task_.displacement_mm, x_mm, y_mm);
  return request;
}

MotionRequest InclusionIdentification::next_request() const {
  if (replay_) return {};
  if (const auto place = open_place_mm()) {
    const std::size_t done = collector_.completed();
    const double speed = scans() ? kPressMmPerS : (done % 3 == 0 ? 30.0 : done % 3 == 1 ? 60.0 : 100.0);
    return press_at(place->x, place->y, speed);
  }
  refit(false);
  if (!fit_ || (certain(*fit_) && unseen(*fit_).empty() && moved_mm_ < 0.7)) return {};
  // All is covered, but not known well enough: around the place as it is known now.
  constexpr double kAroundMm = 6.0;
  const hal::Vector3 off = fit_->inclusion.surface_mm - centre_mm();
  const double angle = 2.0 * std::numbers::pi * static_cast<double>(collector_.completed() % 5) / 5.0;
  const double limit_mm = task_.reach_mm + task_.spacing_mm;
  return press_at(std::clamp(off.x, -limit_mm, limit_mm) + (scans() ? kAroundMm * std::cos(angle) : 0.0),
                  std::clamp(off.y, -limit_mm, limit_mm) + (scans() ? kAroundMm * std::sin(angle) : 0.0),
                  kPressMmPerS);
}

}  // namespace hapticd::identification
