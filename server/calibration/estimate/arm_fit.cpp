#include "server/calibration/estimate/arm_fit.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <utility>

#include "server/calibration/estimate/arm_solver.h"
#include "server/calibration/estimate/arm_state.h"
#include "server/calibration/estimate/left_out.h"
#include "server/calibration/estimate/rigid_fit.h"
#include "server/calibration/estimate/stream_offset.h"
#include "server/linear_algebra/least_squares.h"

namespace hapticd::calibration {

namespace {

using Eigen::Matrix3d;
using Eigen::Quaterniond;
using Eigen::Vector3d;

constexpr std::size_t kMinPairs = 40;
constexpr std::size_t kPredictedPlaces = 250;
constexpr double kOffsetBlockS = 2.0;

hal::Error fit_refusal(const char* what, std::string value, const char* limit, const char* remedy) {
  return {what, "calibration", std::move(value), limit, remedy};
}

/// The mean of rotations, against outliers.
Quaterniond mean_rotation(const std::vector<Quaterniond>& rotations) {
  std::vector<double> weights(rotations.size(), 1.0);
  Quaterniond mean = Quaterniond::Identity();
  for (int round = 0; round < 10; ++round) {
    Eigen::Matrix4d sum = Eigen::Matrix4d::Zero();
    for (std::size_t i = 0; i < rotations.size(); ++i) {
      sum += weights[i] * rotations[i].coeffs() * rotations[i].coeffs().transpose();
    }
    mean = Quaterniond(Eigen::Vector4d(linear_algebra::symmetric_eigen(sum).vectors.col(3))).normalized();
    for (std::size_t i = 0; i < rotations.size(); ++i) {
      const double turn = rt::turn_of(mean.conjugate() * rotations[i]).norm();
      weights[i] = 1.0 / (1.0 + turn * turn / 0.0025);
    }
  }
  return mean;
}

hal::Result<ArmState> find_start(const RigStream& rig, const std::vector<ReferencePose>& reference,
                                 const rt::ArmModel& nominal, const ArmFitSettings& settings) {
  ArmState state;
  state.arm = state.nominal = nominal;
  const bool late = settings.method == FitMethod::kArm || settings.method == FitMethod::kRigidLatency;
  if (late) {
    const auto offset = find_offset(rig, reference, settings.earliest_s, settings.latest_s);
    if (!offset) {
      return fit_refusal("the tracker's poses and the rig's do not fall together in time", "",
                         "half of them do",
                         "push poses while the rig runs, with stamps of the rig's clock; or say own_clock");
    }
    if (offset->correlation < kMinCorrelation) {
      return fit_refusal("the tracker does not see the device move",
                         "correlation of the speeds " + std::to_string(offset->correlation), "0.3 … 1",
                         "see whether the marker is on the tool and the stamps are of the rig's clock");
    }
    state.latency_s = offset->offset_s;
  }
  state.drift_origin_s = reference.front().stamp_s;
  std::vector<MarkerPair> pairs;
  std::vector<std::pair<Quaterniond, Quaterniond>> turns;
  for (const ReferencePose& seen : reference) {
    const auto pose = rig.at(state.rig_time_s(seen.stamp_s));
    if (!pose) continue;
    pairs.push_back({pose->tip_mm, pose->orientation.toRotationMatrix(), seen.position_mm});
    if (seen.orientation) turns.emplace_back(pose->orientation, *seen.orientation);
  }
  if (pairs.size() < kMinPairs) {
    return fit_refusal("too few poses of the tracker have one of the rig's", std::to_string(pairs.size()),
                       "at least 40", "push poses while the rig runs, with stamps of the rig's clock");
  }
  const auto rigid = fit_rigid(pairs, false, false);
  if (!rigid) {
    return fit_refusal("all positions lie on a line", "", "motion in three directions",
                       "move the tool through the whole workspace");
  }
  state.reference_from_rig = rigid->transform;
  state.marker_mm = rigid->marker_mm + nominal.tip_offset_mm;
  if (nominal.use == rt::AngleUse::kNone) {
    state.marker_mm = rigid->marker_mm;  // the reported tip takes the place of the wrist
    state.arm.tip_offset_mm = state.nominal.tip_offset_mm = Vector3d::Zero();
  }
  if (!turns.empty()) {
    std::vector<Quaterniond> between;
    for (const auto& [tool, seen] : turns) {
      between.push_back(((state.reference_from_rig.rotation * tool).conjugate() * seen).normalized());
    }
    state.tool_from_marker = mean_rotation(between);
  }
  return state;
}

/// The calibration's parameters from the fit's unknowns.
Eigen::Matrix<double, parameter::kCount, unknown::kCount> parameters_from_unknowns(const Solved& solved,
                                                                                   const ArmFitSettings& s) {
  Eigen::Matrix<double, parameter::kCount, unknown::kCount> map =
      Eigen::Matrix<double, parameter::kCount, unknown::kCount>::Zero();
  map.topLeftCorner<14, 14>().setIdentity();
  map.block<6, 6>(parameter::kRotation, unknown::kRotation).setIdentity();
  if (s.tip_in_marker_mm) {
    const Vector3d arm = solved.state.tool_from_marker * *s.tip_in_marker_mm;
    Matrix3d cross;
    cross << 0.0, -arm.z(), arm.y(), arm.z(), 0.0, -arm.x(), -arm.y(), arm.x(), 0.0;
    map.block<3, 3>(parameter::kTipOffset, unknown::kMarker).setIdentity();
    map.block<3, 3>(parameter::kTipOffset, unknown::kMarkerTurn) = -cross;
  }
  return map;
}

/// A turn of the fit is of reference_from_rig about the tracker's origin, as in ArmCalibration.
void find_block_offsets(const Solved& solved, double noise_mm, ArmFit& fit) {
  double begin_s = HUGE_VAL;
  double product = 0.0;
  double squares = 0.0;
  const auto close = [&] {
    if (begin_s == HUGE_VAL) return;
    // Slower than 5 mm/s on average it says nothing.
    const double sd = squares > 0.0 ? noise_mm / std::sqrt(squares) : HUGE_VAL;
    fit.block_begin_s.push_back(begin_s);
    fit.block_offset_s.push_back(sd < 0.02 ? -product / squares : NAN);
    fit.block_offset_sd_s.push_back(sd);
    product = squares = 0.0;
  };
  for (const FitRow& row : solved.rows) {
    if (!(row.seen->stamp_s < begin_s + kOffsetBlockS) || begin_s == HUGE_VAL) {
      close();
      begin_s = row.seen->stamp_s;
    }
    // Huber's weight, not Tukey's: after a jump of the clock every residual is large.
    const double size = row.residual.head<3>().norm() / solved.noise_mm;
    const double weight = size > 4.0 ? 4.0 / size : 1.0;
    const Vector3d slope = row.jacobian.col(unknown::kLatency).head<3>();
    product += weight * slope.dot(row.residual.head<3>());
    squares += weight * slope.squaredNorm();
  }
  close();
}

void list_parameters(const Solved& solved, const UnknownMatrix& covariance, ArmFit& fit) {
  const rt::ArmModel& arm = solved.state.arm;
  const rt::ArmModel& nominal = solved.state.nominal;
  const auto add = [&](int index, std::string name, double value, double standard, double scale,
                       const char* unit) {
    if (!solved.active[static_cast<std::size_t>(index)]) return;
    fit.parameters.push_back({std::move(name), scale * value, scale * std::sqrt(covariance(index, index)),
                              scale * standard, unit});
  };
  for (int i = 0; i < 3; ++i) {
    const std::string number = std::to_string(i + 1);
    add(parameter::kJointGain + i, "joint_" + number + "_gain", arm.joint_gain[i], nominal.joint_gain[i], 1.0,
        "1");
    add(parameter::kJointOffset + i, "joint_" + number + "_offset", arm.joint_offset_rad[i],
        nominal.joint_offset_rad[i], rt::kDegPerRad, "°");
  }
  add(parameter::kLink, "first_link", arm.first_link_mm, nominal.first_link_mm, 1.0, "mm");
  add(parameter::kLink + 1, "second_link", arm.second_link_mm, nominal.second_link_mm, 1.0, "mm");
  for (int i = 0; i < 3; ++i) {
    const std::string number = std::to_string(i + 1);
    add(parameter::kGimbalGain + i, "gimbal_" + number + "_gain", arm.gimbal_gain[i], nominal.gimbal_gain[i],
        1.0, "1");
    add(parameter::kGimbalOffset + i, "gimbal_" + number + "_offset", arm.gimbal_offset_rad[i],
        nominal.gimbal_offset_rad[i], rt::kDegPerRad, "°");
  }
  for (int i = 0; i < 3; ++i) {
    add(unknown::kPlay + i, "gimbal_" + std::to_string(i + 1) + "_play", 2.0 * solved.state.play_rad[i], 0.0,
        rt::kDegPerRad, "°");
  }
  add(unknown::kLatency, "tracker_latency", solved.state.latency_s, 0.0, 1e3, "ms");
  add(unknown::kDrift, "tracker_clock_drift", solved.state.drift, 0.0, 1e6, "ppm");
}

void predict(const Solved& solved, const RigStream& rig, ArmFit& fit) {
  std::vector<double> errors;
  double squares = 0.0;
  double turns = 0.0;
  const std::size_t stride = 1 + solved.rows.size() / kPredictedPlaces;
  for (std::size_t i = 0; i < solved.rows.size(); i += stride) {
    const auto pose = rig.at(solved.state.rig_time_s(solved.rows[i].seen->stamp_s));
    if (!pose) continue;
    const hal::RigSample sample = sample_of(*pose);
    const double square = position_covariance_mm2(fit.calibration, sample).trace();
    errors.push_back(std::sqrt(square));
    squares += square;
    turns += std::pow(orientation_sd_rad(fit.calibration, sample), 2);
  }
  if (errors.empty()) return;
  std::sort(errors.begin(), errors.end());
  const auto n = static_cast<double>(errors.size());
  const auto quantile = [&](double share) {
    return errors[std::min(errors.size() - 1, static_cast<std::size_t>(share * n))];
  };
  fit.predicted_median_mm = quantile(0.5);
  fit.predicted_95_mm = quantile(0.95);
  fit.predicted_rms_mm = std::sqrt(squares / n);
  fit.predicted_orientation_rad = std::sqrt(turns / n);
}

/// Misfit: what is left once the parameters' covariance is taken off.
void set_misfit(const Solved& solved, const RigStream& rig, const LeftOut& left, ArmFit& fit) {
  Matrix3d explained = Matrix3d::Zero();
  double explained_turn = 0.0;
  double n = 0.0;
  const std::size_t stride = 1 + solved.rows.size() / kPredictedPlaces;
  for (std::size_t i = 0; i < solved.rows.size(); i += stride) {
    const auto pose = rig.at(solved.state.rig_time_s(solved.rows[i].seen->stamp_s));
    if (!pose) continue;
    const hal::RigSample sample = sample_of(*pose);
    explained += position_covariance_mm2(fit.calibration, sample);
    explained_turn += std::pow(orientation_sd_rad(fit.calibration, sample), 2);
    n += 1.0;
  }
  if (n == 0.0) return;
  // Alike in all directions: three numbers of which each may be smaller than its own uncertainty say less.
  const double rest_mm2 = (left.alike_mm2 - explained / n).trace() / 3.0;
  fit.calibration.misfit_mm2 = std::max(0.0, rest_mm2) * Matrix3d::Identity();
  fit.calibration.orientation_misfit_rad =
      std::sqrt(std::max(0.0, left.alike_turn_rad2 - explained_turn / n));
}

}  // namespace

hal::Result<ArmFit> fit_arm(const RigStream& rig, const std::vector<ReferencePose>& reference,
                            const rt::ArmModel& nominal, const ArmFitSettings& settings) {
  if (reference.size() < kMinPairs) {
    return fit_refusal("too few poses of the tracker", std::to_string(reference.size()), "at least 40",
                       "let the tracker run longer");
  }
  auto start = find_start(rig, reference, nominal, settings);
  if (!start) return start.error();
  const bool has_orientation = std::all_of(reference.begin(), reference.end(),
                                           [](const auto& p) { return p.orientation.has_value(); });
  std::vector<const ReferencePose*> seen;
  const std::size_t stride = 1 + (reference.size() - 1) / settings.max_poses;
  for (std::size_t i = 0; i < reference.size(); i += stride) seen.push_back(&reference[i]);
  const auto active = active_unknowns(settings.method, nominal.use, has_orientation, settings.clock_drifts);
  Solved solved = solve_arm(rig, seen, *start, active, settings.given_up);
  if (settings.given_up()) return fit_refusal("the fit was given up", "", "", "start again");
  if (settings.tip_in_marker_mm) {
    solved.state.arm.tip_offset_mm =
        solved.state.marker_mm + solved.state.tool_from_marker * *settings.tip_in_marker_mm;
  }

  ArmFit fit;
  ArmCalibration& c = fit.calibration;
  c.nominal = solved.state.nominal;
  c.arm = solved.state.arm;
  c.registered = true;
  c.reference_from_rig = solved.state.reference_from_rig;
  c.device_from_rig = solved.state.arm.rig_from_base.inverse();
  const UnknownMatrix covariance = agreement(solved) * linear_algebra::invert_scaled(solved.information);
  const auto map = parameters_from_unknowns(solved, settings);
  c.covariance = map * covariance * map.transpose();
  c.covariance.block<3, 3>(parameter::kTipOffset, parameter::kTipOffset) +=
      solved.state.tool_from_marker.toRotationMatrix() * settings.tip_covariance_mm2 *
      solved.state.tool_from_marker.toRotationMatrix().transpose();
  c.tracker_latency_s = fit.latency_s = solved.state.latency_s;
  c.tracker_latency_sd_s = fit.latency_sd_s = std::sqrt(covariance(unknown::kLatency, unknown::kLatency));
  fit.clock_drift = solved.state.drift;
  fit.has_orientation = has_orientation;
  fit.tool_from_marker = {solved.state.tool_from_marker, solved.state.marker_mm};
  fit.poses = solved.rows.size();
  double squares = 0.0;
  for (const FitRow& row : solved.rows) {
    if (row.position_weight <= 0.3) {
      ++fit.outliers;
    } else {
      squares += row.residual.head<3>().squaredNorm();
    }
  }
  fit.residual_rms_mm =
      std::sqrt(squares / static_cast<double>(std::max<std::size_t>(1, fit.poses - fit.outliers)));

  const LeftOut by_time = leave_out(solved, rig, groups_by_time(solved.rows));
  fit.left_out_rms_mm = by_time.rms_mm;
  fit.left_out_place_rms_mm = leave_out(solved, rig, groups_by_place(solved.state, rig, solved.rows)).rms_mm;
  fit.tracker_noise_mm = by_time.noise_mm;
  fit.tracker_noise_rad = by_time.noise_rad;
  set_misfit(solved, rig, by_time, fit);
  predict(solved, rig, fit);
  find_block_offsets(solved, solved.noise_mm, fit);
  list_parameters(solved, covariance, fit);
  return fit;
}

}  // namespace hapticd::calibration
