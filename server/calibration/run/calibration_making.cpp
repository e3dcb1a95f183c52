#include <fmt/format.h>

#include <ctime>
#include <utility>

#include "proto/text/utc_text.h"
#include "server/calibration/estimate/clock_check.h"
#include "server/calibration/estimate/nominal_arm.h"
#include "server/calibration/estimate/pivot_fit.h"
#include "server/calibration/estimate/stream_check.h"
#include "server/calibration/estimate/stream_offset.h"
#include "server/calibration/run/calibration_runner.h"

namespace hapticd::server {

namespace {

using calibration::CalibrationKind;
using calibration::ReferencePose;

constexpr double kMaxPredictedMm = 5.0;
constexpr std::size_t kErrorPoints = 60;

/// Shifts the stamps of a tracker to where both move alike: of a recording nothing but the motion says how
/// far its clock is off. Leaves them if they agree as they are.
void bring_together(const calibration::RigStream& rig, std::vector<ReferencePose>& reference,
                    const calibration::ArmFitSettings& settings) {
  constexpr double kMoreAlike = 0.1;  // of the correlation: not the same offset again, found by fewer speeds
  const auto usual = calibration::find_offset(rig, reference, settings.earliest_s, settings.latest_s);
  const auto any = calibration::find_any_offset(rig, reference, settings.given_up);
  if (!any || (usual && any->correlation < usual->correlation + kMoreAlike)) return;
  for (ReferencePose& pose : reference) pose.stamp_s -= any->offset_s;
}

}  // namespace

Outcome<StoredCalibration> CalibrationRunner::fit(const CalibrationRequest& request,
                                                  const calibration::RigStream& rig,
                                                  std::vector<ReferencePose> reference) {
  const auto refused = [](const hal::Error& error) {
    return Refusal{RefusalKind::kFailedPrecondition, error};
  };
  const Callback<bool()> given_up = [this] { return cancel_.load(); };
  StoredCalibration made;
  made.kind = request.kind;
  made.created = text::utc_text(std::time(nullptr) * std::int64_t{1'000'000'000});
  made.rig = session_.rig_info().name;
  if (request.kind == CalibrationKind::kTip) {
    const auto pivot = calibration::fit_pivot(reference, given_up);
    if (!pivot) return refused(pivot.error());
    made.tip_in_marker_mm = pivot->tip_in_marker_mm;
    made.tip_covariance_mm2 = pivot->covariance_mm2;
    made.fit.poses = pivot->poses;
    made.fit.outliers = pivot->outliers;
    made.fit.residual_rms_mm = pivot->residual_rms_mm;
    return made;
  }
  calibration::ArmFitSettings settings;
  settings.method = request.kind == CalibrationKind::kRegistration ? calibration::FitMethod::kRigidLatency
                                                                   : calibration::FitMethod::kArm;
  settings.clock_drifts = request.own_clock;
  settings.given_up = given_up;
  if (!request.tip_calibration.empty()) {
    const auto tip = store_.find(request.tip_calibration);
    if (!tip) return tip.refusal();
    settings.tip_in_marker_mm = tip->tip_in_marker_mm;
    settings.tip_covariance_mm2 = tip->tip_covariance_mm2;
  }
  if (request.recorded && request.own_clock) bring_together(rig, reference, settings);
  if (auto error = calibration::check_stream(rig, reference, settings)) return refused(*error);
  const calibration::NominalArm nominal = calibration::find_nominal_arm(rig.poses());
  if (request.kind == CalibrationKind::kKinematics && nominal.arm.use == rt::AngleUse::kNone) {
    return refused({"the device's angles do not describe its pose", "device",
                    fmt::format("{:.1f} mm, rms", nominal.position_rms_mm),
                    "an arm of two links on a turning base",
                    "calibrate the registration instead: 'hapticctl calibrate registration'"});
  }
  auto fit = calibration::fit_arm(rig, reference, nominal.arm, settings);
  if (!fit) return refused(fit.error());
  if (auto error = calibration::check_clock(*fit)) return refused(*error);
  if (request.kind == CalibrationKind::kKinematics && !(fit->predicted_95_mm < kMaxPredictedMm)) {
    return refused({"the motion does not determine the calibration", "calibration",
                    fmt::format("predicted target error {:.1f} mm", fit->predicted_95_mm), "5 mm",
                    "move through the whole workspace, with the tool turned to all sides, for longer"});
  }
  made.fit = std::move(*fit);
  made.tip_in_marker_mm = settings.tip_in_marker_mm;
  made.tip_covariance_mm2 = settings.tip_covariance_mm2;
  const auto& c = made.fit.calibration;
  const std::size_t stride = 1 + rig.size() / kErrorPoints;
  for (std::size_t i = 0; i < rig.size(); i += stride) {
    const hal::RigSample sample = sample_of(rig.poses()[i]);
    made.target_error.push_back({in_frame(c, correct(c, sample), calibration::Frame::kReference).tip_mm,
                                 position_covariance_mm2(c, sample)});
  }
  return made;
}

}  // namespace hapticd::server
