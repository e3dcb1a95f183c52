#include "hal/modbus/modbus_drive.h"

#include <chrono>
#include <cstdio>
#include <span>
#include <thread>
#include <utility>

namespace hapticd::modbus {

ModbusDrive::ModbusDrive(const ModbusConfig& config, double min_deg, double max_deg)
    : config_(config),
      min_deg_(min_deg),
      max_deg_(max_deg),
      plan_(read_plan(config_.map)),
      link_(config_.link),
      words_(plan_.size()),
      written_(config_.map.registers.size(), 0) {}

std::optional<hal::Error> ModbusDrive::open() {
  written_.assign(written_.size(), 0);
  auto error = link_.open();
  if (!error) error = perform(config_.map.setup);
  setup_is_due_ = error && error->code == hal::ErrorCode::kBusy;
  publish_counts();
  return setup_is_due_ ? std::nullopt : error;
}

void ModbusDrive::close() noexcept {
  if (link_.linked() && !config_.map.release.empty()) (void)perform(config_.map.release);
  link_.close();
}

hal::Result<turntable::DriveReading> ModbusDrive::read() {
  if (setup_is_due_) {
    if (auto error = perform(config_.map.setup)) return *error;
    setup_is_due_ = false;
  }
  for (std::size_t i = 0; i < plan_.size(); ++i) {
    if (auto error = link_.read(plan_[i], words_[i])) {
      publish_counts();
      return *error;
    }
  }
  publish_counts();
  return interpret(config_.map, config_.gear, plan_, words_);
}

std::optional<hal::Error> ModbusDrive::write(const Step& step, const Quantities& quantities) {
  const Register& target = config_.map.registers[step.register_index];
  std::uint32_t& written = written_[step.register_index];
  const auto quantity = [&](double value) -> std::optional<hal::Error> {
    const double number = (to_drive(value, target.unit, config_.gear) - target.offset) / target.scale;
    const auto words = encode(target.format, number);
    if (!words) {
      char text[48];
      std::snprintf(text, sizeof text, "%.6g", number);
      return hal::Error{"the drive's register cannot hold the number",
                        "register map '" + config_.map.name + "', " + target.name, text,
                        "what its type can hold", "check scale, unit, gear and the limits of the turntable"};
    }
    return link_.write(target, std::span(*words).first(words_of(target.format.type)));
  };
  switch (step.kind) {
    case Step::Kind::kTarget:
      return quantity(quantities.target_deg);
    case Step::Kind::kSpeed:
      return quantity(quantities.limits.speed_deg_per_s);
    case Step::Kind::kAcceleration:
      return quantity(quantities.limits.acceleration_deg_per_s2);
    case Step::Kind::kValue:
      written = step.value;
      break;
    case Step::Kind::kSet:
      written |= step.value;
      break;
    case Step::Kind::kClear:
      written &= ~step.value;
      break;
  }
  const Words words = encode_bits(target.format, written);
  return link_.write(target, std::span(words).first(words_of(target.format.type)));
}

std::optional<hal::Error> ModbusDrive::perform(const Sequence& sequence, const Quantities& quantities) {
  for (const Step& step : sequence) {
    if (auto error = write(step, quantities)) {
      publish_counts();
      return error;
    }
    if (step.then_wait_s > 0.0) std::this_thread::sleep_for(std::chrono::duration<double>(step.then_wait_s));
  }
  publish_counts();
  return std::nullopt;
}

std::optional<hal::Error> ModbusDrive::start_move(double target_deg, const hal::MotionLimits& limits) {
  return perform(config_.map.start, {target_deg, limits});
}

std::optional<hal::Error> ModbusDrive::start_home() {
  if (config_.map.home.empty()) {
    return hal::Error{"the register map has no command to home", "register map '" + config_.map.name + "'",
                      "", "", "add 'home' to the map, or home the drive with its own tools"};
  }
  return perform(config_.map.home);
}

std::optional<hal::Error> ModbusDrive::stop() {
  return perform(config_.map.stop);
}

std::optional<hal::Error> ModbusDrive::reset_alarm() {
  if (config_.map.reset.empty()) {
    return hal::Error{"the register map has no command to reset an alarm",
                      "register map '" + config_.map.name + "'", "", "",
                      "add 'reset' to the map, or reset the drive with its own tools"};
  }
  return perform(config_.map.reset);
}

std::string ModbusDrive::hint_for_implausible() const {
  return hint_of_order(config_.map, config_.gear, plan_, words_, min_deg_, max_deg_);
}

std::string ModbusDrive::connection() const {
  return to_text(config_.link) + ", map " + config_.map.name;
}

std::string ModbusDrive::alarm_text(std::uint32_t code) const {
  const auto found = config_.map.alarm_texts.find(code);
  return found != config_.map.alarm_texts.end() ? found->second : "see the drive's manual";
}

void ModbusDrive::publish_counts() noexcept {
  const LinkCounts& now = link_.counts();
  const std::array all{now.requests,   now.timeouts, now.exceptions,
                       now.bad_frames, now.broken,   now.late_answers};
  for (std::size_t i = 0; i < all.size(); ++i) counts_[i].store(all[i], std::memory_order_relaxed);
}

std::vector<hal::PartFigure> ModbusDrive::figures() const {
  constexpr std::array kNames{"requests",   "timeouts",           "exceptions",
                              "bad_frames", "broken_connections", "late_answers"};
  std::vector<hal::PartFigure> figures;
  for (std::size_t i = 0; i < kNames.size(); ++i) {
    figures.push_back({kNames[i], static_cast<double>(counts_[i].load(std::memory_order_relaxed)), ""});
  }
  return figures;
}

hal::Result<std::unique_ptr<hal::Turntable>> create(const ModbusConfig& config,
                                                    const turntable::TurntableSettings& settings) {
  if (auto error = check(config.link)) return *error;
  if (auto error = check(config.map)) return *error;
  if (auto error = turntable::check(settings)) return *error;
  auto drive = std::make_unique<ModbusDrive>(config, settings.min_deg, settings.max_deg);
  return std::unique_ptr<hal::Turntable>(
      std::make_unique<turntable::DrivenTurntable>("modbus:" + config.map.name, settings, std::move(drive)));
}

}  // namespace hapticd::modbus
