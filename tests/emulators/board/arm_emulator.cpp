#include "tests/emulators/board/arm_emulator.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

namespace hapticd::emulators {

namespace {
constexpr double kTurn = 6.28318530717958647692;
}  // namespace

std::array<double, 3> ArmEmulator::joints(const hal::Vector3& tip_mm) const {
  const hal::Vector3 p = tip_mm - arm_.shoulder_mm;
  const double side = p.x < 0.0 ? -1.0 : 1.0;  // the base turns a quarter at most, either way
  const double base = std::atan2(side * p.y, side * p.x);
  const double out = side * std::sqrt(p.x * p.x + p.y * p.y);
  const double span = std::sqrt(out * out + p.z * p.z);
  const double a = arm_.upper_arm_mm;
  const double b = arm_.forearm_mm;
  // Triangle shoulder, elbow, tip; the elbow is above the line from shoulder to tip.
  const double at_shoulder =
      std::acos(std::clamp((a * a + span * span - b * b) / (2.0 * a * span), -1.0, 1.0));
  double elevation = std::atan2(p.z, out) + at_shoulder;
  if (elevation > 0.5 * kTurn) elevation -= kTurn;
  const double elbow_out = a * std::cos(elevation);
  const double elbow_up = a * std::sin(elevation);
  double swing = std::atan2(out - elbow_out, elbow_up - p.z);
  if (swing < -1.0) swing += kTurn;  // the forearm can swing beyond overhead, not far behind
  return {base, elevation, swing};
}

hal::Vector3 ArmEmulator::tip_mm(const std::array<double, 3>& q) const {
  const double out = arm_.upper_arm_mm * std::cos(q[1]) + arm_.forearm_mm * std::sin(q[2]);
  const double up = arm_.upper_arm_mm * std::sin(q[1]) - arm_.forearm_mm * std::cos(q[2]);
  return arm_.shoulder_mm + hal::Vector3{out * std::cos(q[0]), out * std::sin(q[0]), up};
}

std::array<std::int64_t, 3> ArmEmulator::counts(const std::array<double, 3>& q) const {
  std::array<std::int64_t, 3> counts{};
  for (std::size_t i = 0; i < 3; ++i) {
    counts[i] = std::llround(q[i] / kTurn * arm_.gear[i] * arm_.counts_per_motor_turn[i]);
  }
  return counts;
}

// By matrices: the tool's axes as the rig sees them, then as the forearm does.
std::array<double, 3> ArmEmulator::gimbal(const std::array<double, 3>& q, const hal::Quaternion& o) const {
  const Eigen::Matrix3d tool = Eigen::Quaterniond(o.w, o.x, o.y, o.z).normalized().toRotationMatrix();
  // The forearm's own axes: outwards, sideways, up; swung by q[2] from hanging, in the plane that the base
  // has turned by q[0].
  const double cb = std::cos(q[0]), sb = std::sin(q[0]), cs = std::cos(q[2]), ss = std::sin(q[2]);
  Eigen::Matrix3d forearm;
  forearm << cb * cs, sb * cs, ss, -sb, cb, 0.0, -cb * ss, -sb * ss, cs;
  const Eigen::Matrix3d m = forearm * tool;
  return {std::atan2(m(1, 0), m(0, 0)), std::asin(std::clamp(-m(2, 0), -1.0, 1.0)),
          std::atan2(m(2, 1), m(2, 2))};
}

// Virtual work: force · (tip's step a joint makes) = torque of the joint · its step.
hal::Vector3 ArmEmulator::tip_force_n(const std::array<double, 3>& q,
                                      const std::array<double, 3>& volts) const {
  constexpr double kStep = 1e-5;
  Eigen::Matrix3d steps;
  Eigen::Vector3d work;
  for (std::size_t i = 0; i < 3; ++i) {
    std::array<double, 3> ahead = q;
    std::array<double, 3> behind = q;
    ahead[i] += kStep;
    behind[i] -= kStep;
    const hal::Vector3 step = (tip_mm(ahead) - tip_mm(behind)) * (1.0 / (2.0 * kStep));
    const auto row = static_cast<Eigen::Index>(i);
    steps.row(row) << step.x, step.y, step.z;
    work(row) = volts[i] * arm_.amplifier_a_per_v[i] * arm_.motor_n_mm_per_a[i] * arm_.gear[i];
  }
  const Eigen::Vector3d force = steps.partialPivLu().solve(work);
  return {force.x(), force.y(), force.z()};
}

}  // namespace hapticd::emulators
