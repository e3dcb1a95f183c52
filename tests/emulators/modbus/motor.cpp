#include "tests/emulators/modbus/motor.h"

#include <algorithm>
#include <cmath>

namespace hapticd::test {

namespace {
constexpr double kStepS = 0.001;
constexpr double kSeekSpeed = 150.0;
constexpr double kWindowDeg = 0.05;
}  // namespace

bool EmulatedMotor::in_position() const {
  return mode_ == Mode::kRest && std::abs(angle_deg_ - target_angle_) < kWindowDeg;
}

void EmulatedMotor::set_limits(double speed_deg_per_s, double acceleration_deg_per_s2) {
  if (speed_deg_per_s > 0.0 && std::isfinite(speed_deg_per_s)) speed_ = speed_deg_per_s;
  if (acceleration_deg_per_s2 > 0.0 && std::isfinite(acceleration_deg_per_s2))
    acceleration_ = acceleration_deg_per_s2;
}

void EmulatedMotor::enable(bool on) {
  enabled_ = on && alarm_ == 0;
  if (!enabled_) {
    mode_ = Mode::kRest;
    velocity_ = 0.0;
  }
}

void EmulatedMotor::start(double counter_target_deg) {
  if (!enabled_ || alarm_ != 0) return;
  target_angle_ = counter_target_deg + counter_zero_deg_;
  mode_ = Mode::kMove;
}

void EmulatedMotor::home() {
  if (!enabled_ || alarm_ != 0) return;
  homed_ = false;
  mode_ = Mode::kSeek;
}

void EmulatedMotor::stop() {
  if (mode_ != Mode::kRest) mode_ = Mode::kStop;
}

void EmulatedMotor::reset() {
  alarm_ = 0;
}

void EmulatedMotor::restart() {
  const double angle = angle_deg_;
  *this = EmulatedMotor();
  angle_deg_ = counter_zero_deg_ = target_angle_ = angle;
}

void EmulatedMotor::raise_alarm(std::uint16_t code) {
  alarm_ = code;
  enable(false);
}

void EmulatedMotor::advance(double seconds) {
  for (double left = std::min(seconds, 10.0); left > 0.0; left -= kStepS) step(std::min(left, kStepS));
}

void EmulatedMotor::approach(double velocity, double seconds) {
  const double most = acceleration_ * seconds;
  velocity_ += std::clamp(velocity - velocity_, -most, most);
  if (held_) velocity_ = 0.0;
  angle_deg_ += velocity_ * seconds;
}

void EmulatedMotor::step(double seconds) {
  switch (mode_) {
    case Mode::kRest:
      velocity_ = 0.0;
      return;
    case Mode::kStop:
      approach(0.0, seconds);
      if (velocity_ == 0.0) mode_ = Mode::kRest;
      return;
    case Mode::kSeek: {
      // Back to the switch, which is closed below zero.
      approach(angle_deg_ > 0.0 ? -kSeekSpeed : kSeekSpeed, seconds);
      if (!held_ && std::abs(angle_deg_) < 0.2) {
        angle_deg_ = counter_zero_deg_ = target_angle_ = velocity_ = 0.0;
        homed_ = true;
        mode_ = Mode::kRest;
      }
      return;
    }
    case Mode::kMove: {
      const double way = target_angle_ - angle_deg_;
      // As fast as it may be and still come to rest in time.
      const double braking = std::sqrt(2.0 * acceleration_ * std::max(std::abs(way) - 0.002, 0.0));
      approach(std::copysign(std::min(speed_, braking), way), seconds);
      if (!held_ && std::abs(target_angle_ - angle_deg_) < 0.01 && std::abs(velocity_) < 2.0) {
        angle_deg_ = target_angle_;
        velocity_ = 0.0;
        mode_ = Mode::kRest;
      }
      return;
    }
  }
}

}  // namespace hapticd::test
