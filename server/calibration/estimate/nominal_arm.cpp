#include "server/calibration/estimate/nominal_arm.h"

#include <Eigen/Geometry>
#include <cmath>
#include <cstddef>

#include "server/linear_algebra/least_squares.h"

namespace hapticd::calibration {

namespace {

using Eigen::Matrix3d;
using Eigen::MatrixXd;
using Eigen::Quaterniond;
using Eigen::Vector3d;
using Eigen::VectorXd;

constexpr std::size_t kMinPosesOfArm = 50;
constexpr std::size_t kMaxPosesOfArm = 300;
/// Encoders' steps and readings that are not quite of one instant stay below these.
constexpr double kMaxPositionMm = 0.3;
constexpr double kMaxOrientationRad = 0.02;

Vector3d signs(unsigned bits) {
  return {(bits & 1U) != 0 ? -1.0 : 1.0, (bits & 2U) != 0 ? -1.0 : 1.0, (bits & 4U) != 0 ? -1.0 : 1.0};
}

double position_rms_mm(const rt::ArmModel& arm, const std::vector<RigPose>& poses) {
  double sum = 0.0;
  for (const RigPose& p : poses) {
    sum += (p.tip_mm - wrist_mm(arm, p.angles) - p.orientation * arm.tip_offset_mm).squaredNorm();
  }
  return std::sqrt(sum / static_cast<double>(poses.size()));
}

/// Starts with what is linear in l1 R, l2 R, the tip's offset and the base's place, were they free of each
/// other.
bool start(rt::ArmModel& arm, const std::vector<RigPose>& poses, double& condition) {
  MatrixXd rows(static_cast<Eigen::Index>(3 * poses.size()), 24);
  VectorXd right(rows.rows());
  rows.setZero();
  Eigen::Index at = 0;
  for (const RigPose& p : poses) {
    const Vector3d q = joint_angles_rad(arm, p.angles);
    const Vector3d a(std::cos(q[1]) * std::cos(q[0]), std::cos(q[1]) * std::sin(q[0]), std::sin(q[1]));
    const Vector3d b(std::sin(q[2]) * std::cos(q[0]), std::sin(q[2]) * std::sin(q[0]), -std::cos(q[2]));
    const Matrix3d tool = p.orientation.toRotationMatrix();
    for (int i = 0; i < 3; ++i, ++at) {
      rows.block<1, 3>(at, 3 * i) = a.transpose();
      rows.block<1, 3>(at, 9 + 3 * i) = b.transpose();
      rows.block<1, 3>(at, 18) = tool.row(i);
      rows(at, 21 + i) = 1.0;
      right[at] = p.tip_mm[i];
    }
  }
  const auto [x, reciprocal_condition] = linear_algebra::solve_by_singular_values(rows, right);
  condition = reciprocal_condition;
  if (!x.allFinite()) return false;
  Matrix3d first;
  Matrix3d second;
  for (int i = 0; i < 3; ++i) {
    first.row(i) = x.segment<3>(3 * i).transpose();
    second.row(i) = x.segment<3>(9 + 3 * i).transpose();
  }
  const linear_algebra::SingularValues3 polar = linear_algebra::singular_values(first + second);
  const Matrix3d rotation = polar.u * polar.v.transpose();
  if (rotation.determinant() < 0.0) return false;
  arm.rig_from_base.rotation = Quaterniond(rotation).normalized();
  arm.rig_from_base.translation_mm = x.tail<3>();
  arm.first_link_mm = (rotation.transpose() * first).trace() / 3.0;
  arm.second_link_mm = (rotation.transpose() * second).trace() / 3.0;
  arm.tip_offset_mm = x.segment<3>(18);
  return arm.first_link_mm > 1.0 && arm.second_link_mm > 1.0;
}

rt::ArmModel moved(const rt::ArmModel& arm, const VectorXd& step) {
  rt::ArmModel m = arm;
  m.rig_from_base.rotation = rt::rotation_by(step.head<3>()) * arm.rig_from_base.rotation;
  m.rig_from_base.translation_mm += step.segment<3>(3);
  m.first_link_mm += step[6];
  m.second_link_mm += step[7];
  m.joint_offset_rad[1] += step[8];
  m.joint_offset_rad[2] += step[9];
  m.tip_offset_mm += step.tail<3>();
  return m;
}

VectorXd position_residuals(const rt::ArmModel& arm, const std::vector<RigPose>& poses) {
  VectorXd r(static_cast<Eigen::Index>(3 * poses.size()));
  Eigen::Index at = 0;
  for (const RigPose& p : poses) {
    r.segment<3>(at) = p.tip_mm - wrist_mm(arm, p.angles) - p.orientation * arm.tip_offset_mm;
    at += 3;
  }
  return r;
}

/// Refines all of them together; the start is near.
rt::ArmModel refined(const rt::ArmModel& start, const std::vector<RigPose>& poses) {
  VectorXd h = VectorXd::Constant(13, 1e-4);
  h.head<3>().setConstant(1e-6);
  h.segment<2>(8).setConstant(1e-6);
  return linear_algebra::minimise(
             start,
             [&](const rt::ArmModel& arm) {
               linear_algebra::NormalEquations equations(h.size());
               equations.add(
                   linear_algebra::central_differences(
                       [&](const VectorXd& step) { return position_residuals(moved(arm, step), poses); }, h),
                   position_residuals(arm, poses));
               return equations;
             },
             [&](const rt::ArmModel& arm) { return position_residuals(arm, poses).squaredNorm(); }, moved)
      .state;
}

/// Variation of what is left between gimbal and tool, for given zeros of the gimbal.
double gimbal_rms_rad(rt::ArmModel& arm, const std::vector<RigPose>& poses) {
  arm.gimbal_to_tool = Quaterniond::Identity();
  Eigen::Matrix4d sum = Eigen::Matrix4d::Zero();
  std::vector<Quaterniond> rest;
  for (const RigPose& p : poses) {
    rest.push_back(tool_orientation(arm, p.angles).conjugate() * p.orientation);
    sum += rest.back().coeffs() * rest.back().coeffs().transpose();
  }
  arm.gimbal_to_tool =
      Quaterniond(Eigen::Vector4d(linear_algebra::symmetric_eigen(sum).vectors.col(3))).normalized();
  double squares = 0.0;
  for (const Quaterniond& q : rest) squares += rt::turn_of(arm.gimbal_to_tool.conjugate() * q).squaredNorm();
  return std::sqrt(squares / static_cast<double>(rest.size()));
}

/// Finds the zeros of the first two angles by steps along each that halve, from the device's own.
double refine_gimbal(rt::ArmModel& arm, const std::vector<RigPose>& poses) {
  double rms = gimbal_rms_rad(arm, poses);
  double step = 0.2;
  while (step > 1e-5) {
    bool better = false;
    for (const int i : {0, 1}) {
      for (const double sign : {1.0, -1.0}) {
        rt::ArmModel tried = arm;
        tried.gimbal_offset_rad[i] += sign * step;
        const double value = gimbal_rms_rad(tried, poses);
        if (value < rms) {
          arm = tried;
          rms = value;
          better = true;
        }
      }
    }
    if (!better) step *= 0.5;
  }
  return rms;
}

}  // namespace

NominalArm find_nominal_arm(const std::vector<RigPose>& all) {
  std::vector<RigPose> poses;
  const std::size_t stride = 1 + all.size() / kMaxPosesOfArm;
  for (std::size_t i = 0; i < all.size(); i += stride) {
    if (all[i].angles.known) poses.push_back(all[i]);
  }
  NominalArm found;
  if (poses.size() < kMinPosesOfArm) return found;
  found.position_rms_mm = HUGE_VAL;
  for (unsigned bits = 0; bits < 8; ++bits) {
    rt::ArmModel arm;
    arm.joint_gain = signs(bits);
    double condition = 0.0;
    if (!start(arm, poses, condition)) continue;
    arm = refined(arm, poses);
    const double rms = position_rms_mm(arm, poses);
    // The same arm can be described with other signs and a base that is turned: the first one stays.
    if (rms < 0.9 * found.position_rms_mm) found = {arm, rms, 0.0, condition};
  }
  if (!(found.position_rms_mm < kMaxPositionMm)) return found;
  found.arm.use = rt::AngleUse::kPosition;
  found.orientation_rms_rad = HUGE_VAL;
  rt::ArmModel best = found.arm;
  for (unsigned bits = 0; bits < 8; ++bits) {
    rt::ArmModel arm = found.arm;
    arm.gimbal_gain = signs(bits);
    const double rms = gimbal_rms_rad(arm, poses);
    if (rms < found.orientation_rms_rad) {
      found.orientation_rms_rad = rms;
      best = arm;
    }
  }
  found.orientation_rms_rad = refine_gimbal(best, poses);
  if (found.orientation_rms_rad < kMaxOrientationRad) {
    best.use = rt::AngleUse::kPose;
    found.arm = best;
  }
  return found;
}

}  // namespace hapticd::calibration
