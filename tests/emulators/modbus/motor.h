#pragma once

#include <cstdint>

namespace hapticd::test {

/// The mechanics and the firmware of an emulated drive: a table with inertia enough for a trapezoid, a home
/// switch, a counter that starts anywhere. Moves with the seconds it is given.
class EmulatedMotor {
 public:
  void advance(double seconds);

  void set_limits(double speed_deg_per_s, double acceleration_deg_per_s2);
  void enable(bool on);
  void start(double counter_target_deg);
  void home();
  void stop();
  void reset();

  /// Loses the counter: it starts again at the table's present place, and nothing is homed.
  void restart();
  void raise_alarm(std::uint16_t code);
  /// A table that is held fast, whatever the motor does.
  void hold(bool held) { held_ = held; }
  /// Someone turns the table by hand.
  void turn_by_hand(double degrees) { angle_deg_ += degrees; }

  double counter_deg() const { return angle_deg_ - counter_zero_deg_; }
  double angle_deg() const { return angle_deg_; }  ///< of the table, by the home switch
  double velocity_deg_per_s() const { return velocity_; }
  double target_deg() const { return target_angle_ - counter_zero_deg_; }
  bool enabled() const { return enabled_; }
  bool homed() const { return homed_; }
  bool moving() const { return mode_ != Mode::kRest; }
  bool in_position() const;
  std::uint16_t alarm() const { return alarm_; }

 private:
  enum class Mode { kRest, kMove, kSeek, kStop };
  void step(double seconds);
  void approach(double velocity, double seconds);

  Mode mode_ = Mode::kRest;
  double angle_deg_ = 40.0;  ///< angle of the table at power-up
  double counter_zero_deg_ = 40.0;
  double velocity_ = 0.0;
  double target_angle_ = 40.0;
  double speed_ = 60.0;
  double acceleration_ = 240.0;
  bool enabled_ = false;
  bool homed_ = false;
  bool held_ = false;
  std::uint16_t alarm_ = 0;
};

}  // namespace hapticd::test
