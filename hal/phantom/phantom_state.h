#pragma once

#include <algorithm>
#include <array>
#include <atomic>
#include <cstdint>
#include <memory>
#include <utility>

#include "hal/lock/mutex.h"
#include "hal/phantom/drive.h"
#include "hal/phantom/exit_cut.h"
#include "hal/phantom/motion_check.h"
#include "hal/phantom/phantom_device.h"
#include "hal/phantom/watchdog.h"
#include "hal/phantom/winding_heat.h"

namespace hapticd::phantom {

inline constexpr Volts kZeroVolts{};

/// Why the engaged device gives no force; several reasons may apply at once.
enum Trouble : std::uint32_t {
  kCountersFail = 1U << 0,
  kOutputsFail = 1U << 1,
  kEncoderJumped = 1U << 2,
  kBeyondStops = 1U << 3,
  kTooHot = 1U << 4,
};

/// The arm as the tick knows it, and what other threads see of it.
struct PhantomDevice::State final : CutAtExit {
  State(const PhantomConfig& config_, std::shared_ptr<daq::Board> board_)
      : config(config_),
        board(std::move(board_)),
        drive(config),
        encoders(config.gimbal ? 6 : 3),
        motion(config.max_joint_speed_rad_per_s, drive.rad_per_count(), config.max_speed_mm_per_s),
        watchdog(*board, kZeroVolts.size(), config.watchdog_ms) {
    info.model = config.model;
    info.max_force_n = std::min(
        config.max_force_n, force_in_any_direction_n(config, config.reset_pose_rad, config.peak_current_a));
    info.max_continuous_force_n = std::min(config.max_continuous_force_n, info.max_force_n);
    info.position_resolution_mm = tip_resolution_mm(config, config.reset_pose_rad);
    info.structural_stiffness_n_per_mm = config.structural_stiffness_n_per_mm;
    info.apparent_mass_g = config.apparent_mass_g;
    info.structural_mode_hz = config.structural_mode_hz;
    info.coulomb_friction_n = config.coulomb_friction_n;
    tip_mm = forward_mm(config.arm, config.reset_pose_rad) + config.origin_mm;
  }

  const PhantomConfig config;
  const std::shared_ptr<daq::Board> board;
  const Drive drive;
  const std::size_t encoders;
  hal::DeviceInfo info;

  // Used by the tick only.
  MotionCheck motion;
  std::array<WindingHeat, 3> heat{};
  std::int64_t heat_ns = 0;
  Currents held_a{};
  std::uint64_t known_engagement = 0;
  std::array<std::int64_t, daq::kMaxCounters> counts{};
  std::array<std::int64_t, daq::kMaxCounters> zero{};
  std::array<std::int64_t, daq::kMaxCounters> still_at{};
  std::int64_t still_since_ns = 0;
  JointAngles q{};
  hal::Vector3 tip_mm;
  std::array<double, 3> gimbal_rad{};
  hal::Quaternion turned;
  bool is_home = false;
  bool jumped = false;
  bool beyond = false;
  bool counters_fail = false;
  bool outputs_fail = false;
  bool over_force = false;

  // Shared between threads.
  SerialMutex engage_mutex;  ///< for engage() and disengage(); the tick never takes it
  Watchdog watchdog;
  std::atomic<bool> engaged{false};
  std::atomic<std::uint64_t> engagement{0};
  std::atomic<std::uint64_t> home_wanted{0};
  std::atomic<std::uint64_t> home_taken{0};
  std::atomic<bool> homed{false};
  std::atomic<std::uint32_t> trouble{0};
  std::atomic<std::uint32_t> last_trouble{0};    ///< the newest that was not 0, since the device is engaged
  std::atomic<std::int64_t> last_trouble_ns{0};  ///< steady clock
  std::atomic<std::uint32_t> status{0};
  std::atomic<int> jumped_joint{-1};
  std::array<std::atomic<double>, 3> reported_heat{};
  std::array<std::atomic<double>, 3> q_reported{};
  std::atomic<std::uint64_t> counter_failures{0};
  std::atomic<std::uint64_t> output_failures{0};
  std::atomic<std::uint64_t> jumps{0};
  std::atomic<std::uint64_t> unfit_commands{0};
  std::atomic<std::uint64_t> scaled_commands{0};
  std::atomic<std::uint64_t> withheld_commands{0};

  void restart() noexcept;
  void take_home(std::int64_t now_ns) noexcept;
  void follow(std::int64_t now_ns) noexcept;
  std::uint32_t troubles() const noexcept;
  void warm_up(std::int64_t now_ns) noexcept;
  /// Force that the motors can now give in this pose in every direction, N.
  double force_now_n() const noexcept;
  /// Currents for the force, scaled together so that none exceeds the present limit of its motor.
  Currents currents_within(const hal::Vector3& force_n) noexcept;
  void put(const Currents& current_a) noexcept;
  void cut_at_exit() noexcept override;
};

}  // namespace hapticd::phantom
