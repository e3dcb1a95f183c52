#pragma once

#include <gtest/gtest.h>

#include <chrono>
#include <functional>
#include <memory>
#include <string>
#include <thread>

#include "hal/modbus/modbus_turntable.h"
#include "server/rig_file/turntable_map.h"
#include "tests/emulators/modbus/emulated_drive.h"
#include "tests/support/part_report.h"
#include "tests/support/value_of.h"

namespace hapticd::test {

/// How long a test waits for what must happen; far beyond what it takes.
inline constexpr std::chrono::seconds kTimeout{20};

inline modbus::RegisterMap built_in_map(const std::string& name) {
  return value_of(server::find_turntable_map(name));
}

/// Stations at 0, 90 and -90 degrees; fast, so that tests are short.
inline turntable::TurntableSettings quick_settings() {
  turntable::TurntableSettings settings;
  settings.speed_deg_per_s = 360.0;
  settings.acceleration_deg_per_s2 = 1440.0;
  settings.poll_hz = 50.0;
  settings.stations = {{"sponge", 0.0, ""}, {"rubber", 90.0, ""}, {"foam", -90.0, ""}};
  return settings;
}

/// A driver and the emulated drive it speaks with, over a real transport.
class DrivenRig {
 public:
  enum class Over { kTcp, kRtu };

  explicit DrivenRig(
      Over over, EmulatedDrive::Make make = EmulatedDrive::Make::kPlain,
      const std::function<void(modbus::ModbusConfig&, turntable::TurntableSettings&)>& adapt = {})
      : drive({make, 1, over == Over::kTcp ? 0 : -1, over == Over::kRtu}) {
    modbus::ModbusConfig config;
    config.map = built_in_map(make == EmulatedDrive::Make::kPlain ? "plain_drive" : "oriental_az");
    config.link.transport = over == Over::kTcp ? modbus::Transport::kTcp : modbus::Transport::kRtu;
    config.link.host = "127.0.0.1";
    config.link.port = drive.port();
    config.link.device = drive.serial_port();
    turntable::TurntableSettings settings = quick_settings();
    // A stall of the machine must not count as a fault of the drive.
    config.link.response_timeout_s = 2.0;
    settings.stale_after_s = 5.0;
    if (adapt) adapt(config, settings);
    table = value_of(modbus::create(config, settings));
  }

  hal::TurntableStatus await(const std::function<bool(const hal::TurntableStatus&)>& condition) const {
    const auto until = std::chrono::steady_clock::now() + kTimeout;
    for (;;) {
      hal::TurntableStatus now = table->status();
      if (condition(now)) return now;
      if (std::chrono::steady_clock::now() > until) {
        ADD_FAILURE() << "waited in vain: " << hal::word_of(now.state) << " at "
                      << now.position_deg.value_or(-999.0) << ", motion " << now.motion.number << " "
                      << hal::word_of(now.motion.end) << " "
                      << (now.motion.problem ? now.motion.problem->text() : "");
        return now;
      }
      std::this_thread::sleep_for(std::chrono::milliseconds(2));
    }
  }
  hal::TurntableStatus await_state(hal::TurntableState state) const {
    return await([state](const hal::TurntableStatus& s) { return s.state == state; });
  }
  hal::TurntableStatus await_end(const hal::Result<std::uint64_t>& motion) const {
    if (!motion) {
      ADD_FAILURE() << motion.error().text();
      return table->status();
    }
    return await([&](const hal::TurntableStatus& s) {
      return s.motion.number == *motion && s.motion.end != hal::MotionEnd::kUnderWay;
    });
  }
  void engage() const {
    const auto error = table->engage();
    ASSERT_FALSE(error) << error->text();
  }
  /// Engaged and homed.
  void home() const {
    engage();
    const hal::MotionReport motion = await_end(table->home()).motion;
    ASSERT_EQ(motion.end, hal::MotionEnd::kArrived)
        << hal::word_of(motion.end) << ": " << (motion.problem ? motion.problem->text() : "");
    await_state(hal::TurntableState::kStanding);
  }
  /// Homed and on a long way, slowly enough for something to happen.
  std::uint64_t set_off(double speed_deg_per_s = 60.0) const {
    home();
    const auto motion = table->move_to(170.0, {speed_deg_per_s, 0.0});
    EXPECT_TRUE(motion);
    await([](const hal::TurntableStatus& s) { return s.position_deg.value_or(0.0) > 5.0; });
    return motion ? *motion : 0;
  }
  hal::TurntableStatus await_end_of(std::uint64_t number) const {
    return await([number](const hal::TurntableStatus& s) {
      return s.motion.number == number && s.motion.end != hal::MotionEnd::kUnderWay;
    });
  }
  double figure(const std::string& name) const { return figure_of(table->report(), name); }

  EmulatedDrive drive;
  std::unique_ptr<hal::Turntable> table;
};

}  // namespace hapticd::test
