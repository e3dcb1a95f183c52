#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <vector>

#include "rt/arm/rigid_transform.h"

namespace hapticd::calibration {

/// A pose of the tool in the rig's frame, and where the marker on it was seen.
struct MarkerPair {
  Eigen::Vector3d tip_mm;
  Eigen::Matrix3d tool;  ///< rotation, tool coordinates into the rig's
  Eigen::Vector3d seen_mm;
};

/// seen = scale · rotation · mirror · (tip + tool · marker) + translation.
struct RigidFit {
  rt::RigidTransform transform;
  Eigen::Vector3d marker_mm = Eigen::Vector3d::Zero();  ///< from the tip, tool frame
  double scale = 1.0;
  double median_residual_mm = 0.0;  ///< in the rig's millimetres
};

/// Points onto points, least squares with weights (Umeyama 1991); never a reflection. Nothing if the points
/// lie on a line.
std::optional<RigidFit> umeyama(const std::vector<Eigen::Vector3d>& from,
                                const std::vector<Eigen::Vector3d>& onto, const std::vector<double>& weights,
                                bool with_scale);

/// Fits with an unknown place of the marker on the tool, against outliers: the best of random small samples
/// (RANSAC), then all pairs with weights that fall with the residual. `mirrored`: x of what was seen is
/// reversed first. Deterministic. At least 12 pairs.
std::optional<RigidFit> fit_rigid(const std::vector<MarkerPair>& pairs, bool mirrored, bool with_scale);

}  // namespace hapticd::calibration
