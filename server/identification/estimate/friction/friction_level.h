#pragma once

#include <Eigen/Core>

#include "server/identification/estimate/friction/friction_rows.h"

namespace hapticd::identification {

/// Level, viscosity and bias by weighted linear least squares; the state is given.
struct FrictionLevel {
  double kinetic = 0.0, viscous = 0.0, bias = 0.0;
  double left = 0.0;                   ///< Σ w e²
  bool viscous_is_identified = false;  ///< distinguishable from the level
};

/// Sums of that least squares.
class FrictionLevelSums {
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

  FrictionLevel solve(bool viscous, bool bias) const;

 private:
  Eigen::Matrix3d ata_ = Eigen::Matrix3d::Zero();
  Eigen::Vector3d atb_ = Eigen::Vector3d::Zero();
  double btb_ = 0.0;
  double instants_ = 0.0;
};

}  // namespace hapticd::identification
