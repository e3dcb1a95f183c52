#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "hal/rig.h"
#include "server/identification/estimate/inclusion/inclusion_fit.h"
#include "server/identification/session/identification_session.h"
#include "server/identification/session/inclusion/press_collector.h"
#include "server/identification/session/tasks.h"

namespace hapticd::identification {

/// A stiff inclusion in an object (D§5.3): its place and what it adds, from presses spread over the object;
/// presses straight over it are enough if its depth is known beforehand. The object without it is known by
/// presses, by its law, or by the presses that are far from the inclusion.
class InclusionIdentification final : public IdentificationSession {
 public:
  InclusionIdentification(const InclusionTask& task, const hal::RigInfo& rig);

  void add(const rt::Observation& observation) override;
  MotionRequest next_request() const override;
  hal::Result<rt::IdentifiedModel> finish() const override;

  static constexpr std::size_t kMinPresses = 8;      ///< of a scan
  static constexpr std::size_t kMinPressesOver = 2;  ///< straight over it
  static constexpr double kMaxPlaceErrorMm = 1.0;    ///< standard error across, to converge
  /// Maximum error of a depth. Most of it is how the added force falls off, which the presses hardly show;
  /// two of it are the 5 mm that an identification promises.
  static constexpr double kMaxDepthErrorMm = 2.5;
  static constexpr double kMaxResidual = 0.6;       ///< what is left over what the inclusion adds
  static constexpr double kMaxLeftOverShare = 0.5;  ///< of what the object's own response leaves

 private:
  void find(IdentificationProgress& progress) const override;
  std::optional<hal::Error> conclude(const IdentificationProgress& now,
                                     rt::IdentifiedModel& model) const override;
  bool scans() const noexcept { return task_.known_depth_mm <= 0.0; }
  std::size_t min_presses() const noexcept { return scans() ? kMinPresses : kMinPressesOver; }
  /// Fits again if presses came.
  void refit(bool now) const;
  hal::Result<InclusionFit> fit() const;
  bool certain(const InclusionFit& fit) const;
  /// True if the data show one at all.
  bool shows_inclusion(const InclusionFit& fit) const;
  Coverage grid() const;
  hal::Vector3 centre_mm() const;
  /// Height of the surface at a place by the presses so far, of the rig.
  double surface_height_mm(double x_mm, double y_mm) const;
  MotionRequest press_at(double x_mm, double y_mm, double speed_mm_per_s) const;
  /// Next place of the scan that has no press yet, from the centre outwards.
  std::optional<hal::Vector3> open_place_mm() const;

  // inclusion_words.cpp
  std::optional<hal::Error> too_little() const;
  std::vector<std::string> unseen(const InclusionFit& fit) const;
  std::vector<std::string> missing(bool is_certain, bool is_steady) const;
  std::vector<rt::EstimatedParameter> parameters_of(const InclusionFit& fit) const;
  std::vector<std::string> remarks() const;
  std::string procedure(const InclusionFit& fit) const;

  InclusionTask task_;
  Estimated tip_radius_mm_;
  bool replay_;
  PressCollector collector_;
  mutable std::optional<InclusionFit> fit_;
  mutable std::optional<hal::Error> failed_;
  mutable std::size_t fitted_presses_ = 0;
  mutable double moved_mm_ = 1e9;  ///< of the place, by the last fit
};

}  // namespace hapticd::identification
