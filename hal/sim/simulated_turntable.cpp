#include "hal/sim/simulated_turntable.h"

#include <algorithm>
#include <chrono>
#include <cmath>

namespace hapticd::sim {

namespace {

using Clock = std::chrono::steady_clock;

constexpr double kStepS = 0.001;
/// A thread that slept longer than this meets a table that waited for it.
constexpr double kMaxGapS = 5.0;
constexpr double kEncoderDeg = 0.01;
constexpr double kSwitchDeg = 0.2;
constexpr double kArrivedDeg = 0.004;
constexpr double kSlowDegPerS = 1.0;

class SimulatedDrive final : public turntable::Drive {
 public:
  SimulatedDrive(const SimulatedTurntableConfig& config, const hal::MotionLimits& limits)
      : homing_deg_per_s_(config.homing_deg_per_s),
        limits_(limits),
        angle_deg_(config.start_deg),
        target_deg_(config.start_deg),
        counter_zero_deg_(config.homed ? 0.0 : config.start_deg),
        homed_(config.homed) {}

  std::optional<hal::Error> open() override {
    linked_ = true;
    return std::nullopt;
  }
  void close() noexcept override { linked_ = false; }
  bool linked() const noexcept override { return linked_; }

  hal::Result<turntable::DriveReading> read() override {
    advance();
    turntable::DriveReading reading;
    reading.position_deg = kEncoderDeg * std::round((angle_deg_ - counter_zero_deg_) / kEncoderDeg);
    reading.velocity_deg_per_s = velocity_deg_per_s_;
    reading.homed = homed_;
    reading.moving = motion_ != Motion::kRest;
    reading.in_position = motion_ == Motion::kRest;
    reading.alarm = false;
    return reading;
  }

  std::optional<hal::Error> start_move(double target_deg, const hal::MotionLimits& limits) override {
    advance();
    limits_ = limits;
    target_deg_ = target_deg + counter_zero_deg_;
    motion_ = Motion::kMove;
    return std::nullopt;
  }
  std::optional<hal::Error> start_home() override {
    advance();
    homed_ = false;
    motion_ = Motion::kHome;
    return std::nullopt;
  }
  std::optional<hal::Error> stop() override {
    advance();
    if (motion_ != Motion::kRest) motion_ = Motion::kStop;
    return std::nullopt;
  }
  std::optional<hal::Error> reset_alarm() override { return std::nullopt; }

  std::string driver() const override { return "sim"; }
  std::string connection() const override { return {}; }
  std::string alarm_text(std::uint32_t) const override { return {}; }
  std::vector<hal::PartFigure> figures() const override { return {}; }

 private:
  enum class Motion : std::uint8_t { kRest, kMove, kHome, kStop };

  void advance() {
    const auto now = Clock::now();
    double left = std::min(std::chrono::duration<double>(now - last_).count(), kMaxGapS);
    last_ = now;
    for (; left > 0.0 && motion_ != Motion::kRest; left -= kStepS) step(std::min(left, kStepS));
  }

  void accelerate_to(double velocity, double seconds) {
    const double most = limits_.acceleration_deg_per_s2 * seconds;
    velocity_deg_per_s_ += std::clamp(velocity - velocity_deg_per_s_, -most, most);
    angle_deg_ += velocity_deg_per_s_ * seconds;
  }

  void rest_at(double angle_deg) {
    angle_deg_ = angle_deg;
    velocity_deg_per_s_ = 0.0;
    motion_ = Motion::kRest;
  }

  void step(double seconds) {
    if (motion_ == Motion::kStop) {
      accelerate_to(0.0, seconds);
      if (velocity_deg_per_s_ == 0.0) rest_at(angle_deg_);
      return;
    }
    // The speed from which the brakes still bring it to rest where it is to be.
    const bool homing = motion_ == Motion::kHome;
    const double way = (homing ? 0.0 : target_deg_) - angle_deg_;
    const double speed = std::min(homing ? homing_deg_per_s_ : limits_.speed_deg_per_s,
                                  std::sqrt(2.0 * limits_.acceleration_deg_per_s2 * std::abs(way)));
    accelerate_to(std::copysign(speed, way), seconds);
    if (homing && std::abs(angle_deg_) < kSwitchDeg && std::abs(velocity_deg_per_s_) < homing_deg_per_s_) {
      rest_at(0.0);
      counter_zero_deg_ = 0.0;
      homed_ = true;
    } else if (!homing && std::abs(target_deg_ - angle_deg_) < kArrivedDeg &&
               std::abs(velocity_deg_per_s_) < kSlowDegPerS) {
      rest_at(target_deg_);
    }
  }

  const double homing_deg_per_s_;
  hal::MotionLimits limits_;
  double angle_deg_;
  double target_deg_;
  double velocity_deg_per_s_ = 0.0;
  double counter_zero_deg_;
  bool homed_;
  bool linked_ = false;
  Motion motion_ = Motion::kRest;
  Clock::time_point last_ = Clock::now();
};

}  // namespace

hal::Result<std::unique_ptr<hal::Turntable>> create_turntable(const SimulatedTurntableConfig& config,
                                                              const turntable::TurntableSettings& settings) {
  if (auto error = turntable::check(settings)) return *error;
  auto drive = std::make_unique<SimulatedDrive>(
      config, hal::MotionLimits{settings.speed_deg_per_s, settings.acceleration_deg_per_s2});
  return std::unique_ptr<hal::Turntable>(
      std::make_unique<turntable::DrivenTurntable>("sim:turntable", settings, std::move(drive)));
}

}  // namespace hapticd::sim
