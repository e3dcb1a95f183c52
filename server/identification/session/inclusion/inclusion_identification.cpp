#include "server/identification/session/inclusion/inclusion_identification.h"

#include <algorithm>
#include <cmath>

#include "rt/signal/vector.h"
#include "server/identification/session/fixed_text.h"

namespace hapticd::identification {

namespace {

constexpr std::size_t kRefitEvery = 3;
constexpr double kSteadyMm = 0.7;

/// A press is seen only from its first loud sample on; a law counts from the surface. Two recordings are late
/// alike.
std::vector<Press> counted_from_surface(std::vector<Press> presses, const rt::HuntCrossleyParameters& law,
                                        double threshold_n) {
  constexpr double kMaxLateMm = 3.0;
  const double quiet_n = Press::kQuietShare * threshold_n;
  const double late_mm = std::pow(quiet_n / law.stiffness_n_per_mm_m, 1.0 / law.exponent);
  for (Press& press : presses) press.surface_mm.z += std::min(kMaxLateMm, late_mm);
  return presses;
}

/// Estimate of what is not known: whatever is equally likely up to 10 mm, its mean and deviation.
constexpr Estimated kUnknownRadius{5.0, 2.9};

Estimated radius_of(const InclusionTask& task) {
  return task.tip_radius_mm ? Estimated{*task.tip_radius_mm, 0.0} : kUnknownRadius;
}

}  // namespace

InclusionIdentification::InclusionIdentification(const InclusionTask& task, const hal::RigInfo& rig)
    : IdentificationSession(inclusion_kind()),
      task_(task),
      tip_radius_mm_(radius_of(task)),
      replay_(rig.kind == hal::RigKind::kReplay),
      collector_(rig, task.threshold_n) {}

void InclusionIdentification::add(const rt::Observation& observation) {
  collector_.add(observation);
}

hal::Result<InclusionFit> InclusionIdentification::fit() const {
  const std::vector<Press>& presses = collector_.presses();
  const InclusionReference& reference = task_.reference;
  std::vector<Press> counted;
  if (reference.law) counted = counted_from_surface(presses, *reference.law, task_.threshold_n);
  const std::vector<Press>& with = reference.law ? counted : presses;
  if (!scans()) return fit_inclusion_response(reference.presses, with, task_.known_depth_mm, reference.law);
  return fit_inclusion_scan(reference.presses, with, reference.law, tip_radius_mm_);
}

void InclusionIdentification::refit(bool now) const {
  const std::size_t presses = collector_.completed();
  if (presses == fitted_presses_ || presses < min_presses()) return;
  if (!now && presses < fitted_presses_ + kRefitEvery && open_place_mm()) return;
  fitted_presses_ = presses;
  hal::Result<InclusionFit> found = fit();
  if (!found) {
    failed_ = found.error();
    return;
  }
  failed_.reset();
  moved_mm_ = fit_ ? rt::norm(found->inclusion.place_mm - fit_->inclusion.place_mm) : 1e9;
  fit_ = std::move(*found);
}

bool InclusionIdentification::certain(const InclusionFit& fit) const {
  if (!fit.converged || !(fit.residual < kMaxResidual) || !shows_inclusion(fit)) return false;
  if (!scans()) return fit.added_at_5mm_n.standard_error < 0.2 * fit.added_at_5mm_n.value;
  const double across_mm = std::hypot(fit.place_x_mm.standard_error, fit.place_y_mm.standard_error);
  return across_mm < kMaxPlaceErrorMm && fit.depth_mm.standard_error < kMaxDepthErrorMm;
}

bool InclusionIdentification::shows_inclusion(const InclusionFit& fit) const {
  return scans() ? !fit.at_bound && fit.left_over_share < kMaxLeftOverShare : fit.residual < 1.0;
}

void InclusionIdentification::find(IdentificationProgress& progress) const {
  refit(false);
  progress.samples = collector_.samples();
  progress.duration_s = collector_.watched_s();
  progress.coverage.push_back(grid());
  bool seen = false;
  if (fit_) {
    progress.parameters = parameters_of(*fit_);
    progress.residual = fit_->residual;
    seen = unseen(*fit_).empty();
    progress.certain = certain(*fit_) && seen;
    progress.steady = replay_ || moved_mm_ < kSteadyMm;
    for (const InclusionFitPoint& point : fit_->points) {
      progress.fit.push_back({point.displacement_mm, point.measured_n, point.model_n});
    }
  }
  const bool covered = replay_ || !open_place_mm();
  progress.converged = covered && !failed_;
  progress.missing = missing(progress.certain, progress.steady);
  progress.remarks = remarks();
  double done = progress.coverage.front().share * (replay_ ? 0.0 : 0.8);
  if (progress.certain) done += replay_ ? 0.9 : 0.1;
  progress.completion = std::min(done, 0.99);
}

hal::Result<rt::IdentifiedModel> InclusionIdentification::finish() const {
  // The last press may have no end in the data; the copy has it.
  InclusionIdentification whole = *this;
  whole.collector_.end();
  if (auto error = whole.too_little()) return *error;
  whole.refit(true);
  return whole.IdentificationSession::finish();
}

std::optional<hal::Error> InclusionIdentification::conclude(const IdentificationProgress& /*now*/,
                                                            rt::IdentifiedModel& model) const {
  if (failed_) return failed_;
  const InclusionFit& found = *fit_;
  if (!shows_inclusion(found)) {
    return refusal(
        "no inclusion is seen: the object's own response explains the presses as well",
        formatted("%.0f %% of what that leaves is left over, depth %.0f mm", 100.0 * found.left_over_share,
                  found.depth_mm.value),
        formatted("less than %.0f %%, at a depth of 9 to 59 mm", 100.0 * kMaxLeftOverShare),
        "press with a ball bearing: a rod rubs; deeper, and closer to where the object feels hard; give a "
        "reference of the object without it");
  }
  rt::InclusionModel content;
  content.place_mm = found.inclusion.place_mm;
  content.surface_mm = found.inclusion.surface_mm;
  content.response = found.inclusion.response;
  content.attenuation = found.inclusion.attenuation;
  content.approach = found.inclusion.approach;
  model.content = content;
  model.validity = {found.inclusion.max_displacement_mm, found.max_speed_mm_per_s, found.max_force_n};
  model.procedure = procedure(found);
  return std::nullopt;
}

}  // namespace hapticd::identification
