#include "tests/reference/friction_fit.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "rt/friction/dahl.h"
#include "rt/signal/vector.h"
#include "server/identification/estimate/friction/friction_normals.h"

namespace hapticd::identification {

namespace {

constexpr double kSlidingMmPerS = 10.0;

// Regimes of D§4.4.1.
constexpr double kSlidingPathMm = 3.0;
constexpr double kPreslidingPathMm = 0.5;
/// A tip that is held by friction still moves a little against the encoders: at rest they say nothing.
constexpr double kMinSpeedMmPerS = 2.0;

/// Way along the line since the motion last turned.
class PathSinceTurn {
 public:
  double update(double along_mm) {
    step_mm_ = started_ ? along_mm - last_mm_ : 0.0;
    started_ = true;
    last_mm_ = along_mm;
    if (step_mm_ * heading_ < 0.0) path_mm_ = 0.0;
    if (step_mm_ != 0.0) heading_ = step_mm_;
    path_mm_ += std::abs(step_mm_);
    return path_mm_;
  }
  void restart() { path_mm_ = 0.0; }
  double step_mm() const { return step_mm_; }
  double path_mm() const { return path_mm_; }

 private:
  bool started_ = false;
  double last_mm_ = 0.0, step_mm_ = 0.0, heading_ = 0.0, path_mm_ = 0.0;
};

MeanDirectionNormals normals_along(const std::vector<StrokeSample>& strokes) {
  MeanDirectionNormals normals;
  PathSinceTurn way;
  for (const StrokeSample& s : strokes) {
    // Right after a turn friction has not turned yet.
    if (way.update(s.along_mm) < kSlidingPathMm || std::abs(s.along_mm_per_s) < kSlidingMmPerS ||
        rt::norm(s.reaction_n) < 0.2) {
      continue;
    }
    normals.add(s.along_mm, s.along_mm_per_s, s.reaction_n);
  }
  normals.settle();
  return normals;
}

struct Row {
  double normal_n, friction_n, slide_mm, speed_mm_per_s;
  double path_mm;  ///< slid since the motion last turned
};

}  // namespace

hal::Result<FrictionFit> fit_friction(const std::vector<StrokeSample>& strokes, const hal::Vector3& along) {
  const MeanDirectionNormals normals = normals_along(strokes);
  if (normals.empty()) {
    return hal::Error{"no place was stroked both ways", "identification of friction",
                      std::to_string(strokes.size()) + " samples", "strokes back and forth along one line",
                      "stroke back and forth over the same place"};
  }
  std::vector<Row> rows;
  PathSinceTurn way;
  for (const StrokeSample& s : strokes) {
    way.update(s.along_mm);
    hal::Vector3 normal;
    if (rt::norm(s.reaction_n) < 0.2 || !normals.at(s.along_mm, normal)) {
      way.restart();
      continue;
    }
    const hal::Vector3 tangent = rt::direction_or(rt::across(along, normal), along);
    const double per_along = 1.0 / std::max(0.2, dot(tangent, along));  // way on the surface
    rows.push_back({dot(s.reaction_n, normal), -dot(s.reaction_n, tangent), way.step_mm() * per_along,
                    s.along_mm_per_s * per_along, way.path_mm() * per_along});
  }

  // Sliding: the level and its viscosity, by least squares.
  double nn = 0.0, nv = 0.0, vv = 0.0, nf = 0.0, vf = 0.0;
  for (const Row& row : rows) {
    if (row.path_mm < kSlidingPathMm || std::abs(row.speed_mm_per_s) < kSlidingMmPerS) continue;
    const double n = std::copysign(row.normal_n, row.speed_mm_per_s);
    nn += n * n;
    nv += n * row.speed_mm_per_s;
    vv += row.speed_mm_per_s * row.speed_mm_per_s;
    nf += n * row.friction_n;
    vf += row.speed_mm_per_s * row.friction_n;
  }
  const double determinant = nn * vv - nv * nv;
  if (!(determinant > 1e-9 * nn * vv)) {
    return hal::Error{"sliding at one speed and force only", "identification of friction", "",
                      "strokes at different speeds and forces",
                      "stroke faster and slower, softer and harder"};
  }
  FrictionFit best;
  best.parameters.kinetic = (nf * vv - vf * nv) / determinant;
  best.parameters.viscous_n_s_per_mm = (vf * nn - nf * nv) / determinant;
  if (best.parameters.viscous_n_s_per_mm < 0.0) {
    best.parameters.viscous_n_s_per_mm = 0.0;
    best.parameters.kinetic = nf / nn;
  }

  // Presliding: the way over which the sign of the friction turns, by search.
  const auto presliding_error = [&](double presliding_mm) {
    double error = 0.0;
    double z = 0.0;
    for (const Row& row : rows) {
      z = rt::dahl_step(z, row.slide_mm, presliding_mm);
      if (row.path_mm > 2.0 * kPreslidingPathMm || std::abs(row.speed_mm_per_s) < kMinSpeedMmPerS) continue;
      error += std::abs(row.friction_n - best.parameters.kinetic * row.normal_n * z);
    }
    return error;
  };
  double least = std::numeric_limits<double>::infinity();
  for (double presliding_mm = 0.05; presliding_mm < 3.0; presliding_mm *= 1.15) {
    const double error = presliding_error(presliding_mm);
    if (error >= least) continue;
    least = error;
    best.parameters.presliding_mm = presliding_mm;
  }

  double error = 0.0;
  double friction = 0.0;
  double z = 0.0;
  for (const Row& row : rows) {
    z = rt::dahl_step(z, row.slide_mm, best.parameters.presliding_mm);
    if (std::abs(row.speed_mm_per_s) < kMinSpeedMmPerS) continue;
    error += std::abs(row.friction_n - best.parameters.kinetic * row.normal_n * z -
                      best.parameters.viscous_n_s_per_mm * row.speed_mm_per_s);
    friction += std::abs(row.friction_n);
  }
  best.relative_error = friction > 0.0 ? error / friction : 0.0;
  return best;
}

}  // namespace hapticd::identification
