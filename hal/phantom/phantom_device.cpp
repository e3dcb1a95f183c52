#include "hal/phantom/phantom_device.h"

#include <fmt/format.h>
#include <time.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <mutex>

#include "hal/phantom/drive.h"
#include "hal/phantom/exit_cut.h"
#include "hal/phantom/motion_check.h"
#include "hal/phantom/watchdog.h"
#include "hal/phantom/winding_heat.h"

namespace hapticd::phantom {

namespace {

namespace status_bit = hal::sample_status;
using Counts = std::array<std::int64_t, 3>;

constexpr Volts kZeroVolts{};
constexpr std::int64_t kStillCounts = 3;
/// Motors warm up between the reading of their limit and the command: a shortfall up to this share is not
/// reported.
constexpr double kAsAsked = 0.99;
constexpr double kRadPerTurn = 2.0 * std::numbers::pi;

/// Why the engaged device gives no force; several reasons may apply at once.
enum Trouble : std::uint32_t {
  kCountersFail = 1U << 0,
  kOutputsFail = 1U << 1,
  kEncoderJumped = 1U << 2,
  kBeyondStops = 1U << 3,
  kTooHot = 1U << 4,
};

}  // namespace

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
  hal::Quaternion turned;
  bool is_home = false;
  bool jumped = false;
  bool beyond = false;
  bool counters_fail = false;
  bool outputs_fail = false;
  bool over_force = false;

  // Shared between threads.
  std::mutex engage_mutex;  ///< for engage() and disengage(); the tick never takes it
  Watchdog watchdog;
  std::atomic<bool> engaged{false};
  std::atomic<std::uint64_t> engagement{0};
  std::atomic<std::uint64_t> home_wanted{0};
  std::atomic<std::uint64_t> home_taken{0};
  std::atomic<bool> homed{false};
  std::atomic<std::uint32_t> trouble{0};
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

// Engaged again: the counters started from somewhere, so nothing is known of the pose.
void PhantomDevice::State::restart() noexcept {
  const std::uint64_t now = engagement.load(std::memory_order_acquire);
  if (now == known_engagement) return;
  known_engagement = now;
  motion.restart();
  is_home = jumped = beyond = counters_fail = outputs_fail = over_force = false;
  still_since_ns = board->now_ns();
  still_at = counts;
}

void PhantomDevice::State::take_home(std::int64_t now_ns) noexcept {
  for (std::size_t i = 0; i < 3; ++i) {
    if (std::abs(counts[i] - still_at[i]) <= kStillCounts) continue;
    still_at = counts;
    still_since_ns = now_ns;
    break;
  }
  const std::uint64_t wanted = home_wanted.load(std::memory_order_acquire);
  if (home_taken.load(std::memory_order_relaxed) == wanted) return;
  if (static_cast<double>(now_ns - still_since_ns) < 1e6 * config.home_still_ms) return;
  zero = counts;
  is_home = true;
  jumped = false;
  motion.restart();
  jumped_joint.store(-1, std::memory_order_relaxed);
  home_taken.store(wanted, std::memory_order_release);
}

void PhantomDevice::State::follow(std::int64_t now_ns) noexcept {
  take_home(now_ns);
  if (!is_home || jumped) return;
  JointAngles seen_rad = drive.turn_rad({counts[0], counts[1], counts[2]}, {zero[0], zero[1], zero[2]});
  for (std::size_t i = 0; i < 3; ++i) seen_rad[i] += config.reset_pose_rad[i];
  if (!motion.plausible(seen_rad, now_ns)) {
    jumped = true;
    jumped_joint.store(motion.jumped_joint(), std::memory_order_relaxed);
    jumps.fetch_add(1, std::memory_order_relaxed);
    return;
  }
  q = seen_rad;
  beyond = beyond_stops_rad(config.arm, q) > config.stop_tolerance_rad;
  tip_mm = forward_mm(config.arm, q) + config.origin_mm;
  motion.follow(tip_mm, now_ns);
  if (config.gimbal) {
    std::array<double, 3> gimbal_rad{};
    for (std::size_t i = 0; i < 3; ++i) {
      gimbal_rad[i] = config.gimbal_reset_rad[i] + kRadPerTurn *
                                                       static_cast<double>(counts[3 + i] - zero[3 + i]) /
                                                       config.gimbal_counts_per_turn[i];
    }
    turned = orientation(q, gimbal_rad);
  }
}

std::uint32_t PhantomDevice::State::troubles() const noexcept {
  const bool hot = std::any_of(heat.begin(), heat.end(), [](const WindingHeat& h) { return h.over(); });
  return (counters_fail ? kCountersFail : 0U) | (outputs_fail ? kOutputsFail : 0U) |
         (jumped ? kEncoderJumped : 0U) | (beyond ? kBeyondStops : 0U) | (hot ? kTooHot : 0U);
}

void PhantomDevice::State::warm_up(std::int64_t now_ns) noexcept {
  const double dt_s = heat_ns == 0 ? 0.0 : std::max(0.0, 1e-9 * static_cast<double>(now_ns - heat_ns));
  heat_ns = now_ns;
  for (std::size_t i = 0; i < 3; ++i) {
    heat[i].advance(held_a[i], config.continuous_current_a[i], config.thermal_time_constant_s, dt_s);
    reported_heat[i].store(heat[i].heat(), std::memory_order_relaxed);
  }
}

double PhantomDevice::State::force_now_n() const noexcept {
  Currents allowed_a{};
  for (std::size_t i = 0; i < 3; ++i) {
    allowed_a[i] = heat[i].allowed_a(config.peak_current_a[i], config.continuous_current_a[i]);
  }
  return std::min(config.max_force_n, force_in_any_direction_n(config, drive, q, allowed_a));
}

Currents PhantomDevice::State::currents_within(const hal::Vector3& force_n) noexcept {
  Currents current_a = drive.currents_for(torques_for_n_mm(config.arm, q, force_n));
  double scale = 1.0;
  for (std::size_t i = 0; i < 3; ++i) {
    const double allowed_a = heat[i].allowed_a(config.peak_current_a[i], config.continuous_current_a[i]);
    if (std::abs(current_a[i]) > allowed_a) scale = std::min(scale, allowed_a / std::abs(current_a[i]));
  }
  over_force = scale < kAsAsked;
  for (double& a : current_a) a *= scale;
  return current_a;
}

void PhantomDevice::State::put(const Currents& current_a) noexcept {
  const Volts volts = drive.volts_for(current_a);
  outputs_fail = !board->write_volts(volts);
  if (!outputs_fail) {
    held_a = current_a;
    return;
  }
  output_failures.fetch_add(1, std::memory_order_relaxed);
  // Old or new, no one knows: the hotter counts.
  for (std::size_t i = 0; i < 3; ++i) held_a[i] = std::max(std::abs(held_a[i]), std::abs(current_a[i]));
}

void PhantomDevice::State::cut_at_exit() noexcept {
  engaged.store(false, std::memory_order_release);
  board->write_volts(kZeroVolts);
}

hal::Result<std::unique_ptr<PhantomDevice>> PhantomDevice::create(const PhantomConfig& config,
                                                                  std::shared_ptr<daq::Board> board) {
  const std::string where = "haptic device";
  if (!board) return hal::Error{"no board", where, "", "", "configure the board that the device is wired to"};
  if (auto error = check(config)) return *error;
  const daq::BoardInfo info = board->info();
  const std::size_t counters = config.gimbal ? 6 : 3;
  if (info.outputs < 3 || info.counters < counters) {
    return hal::Error{"the board is not configured for the device", where,
                      fmt::format("{} outputs, {} counters", info.outputs, info.counters),
                      fmt::format("3 outputs, {} counters", counters),
                      "name the channels of all motors and encoders in the board's section"};
  }
  return std::unique_ptr<PhantomDevice>(new PhantomDevice(std::make_unique<State>(config, std::move(board))));
}

PhantomDevice::PhantomDevice(std::unique_ptr<State> state) : state_(std::move(state)) {}
PhantomDevice::~PhantomDevice() {
  disengage();
}

const hal::DeviceInfo& PhantomDevice::info() const noexcept {
  return state_->info;
}
bool PhantomDevice::homed() const noexcept {
  return state_->homed.load(std::memory_order_acquire);
}
std::vector<hal::UncertainParameter> PhantomDevice::uncertain() const {
  return uncertain_parameters(state_->config);
}

std::optional<hal::Error> PhantomDevice::engage() {
  State& state = *state_;
  const std::lock_guard lock(state.engage_mutex);
  if (state.engaged.load(std::memory_order_acquire)) return std::nullopt;
  if (auto error = state.board->engage(daq::BoardUse::kMotion)) return error;
  // No one ticks on it yet, so this thread may try what the tick will do.
  std::array<std::int64_t, daq::kMaxCounters> first{};
  const bool reads = state.board->read_counters(std::span(first).first(state.encoders));
  if (!reads || !state.board->write_volts(kZeroVolts)) {
    state.board->release(daq::BoardUse::kMotion);
    return hal::Error{reads ? "the board does not accept volts for the motors"
                            : "the board does not give the encoders' counts",
                      "haptic device", "", "", "check the board and its section in the configuration"};
  }
  state.homed.store(false, std::memory_order_release);
  state.trouble.store(0, std::memory_order_relaxed);
  state.status.store(status_bit::kDeviceNotReady, std::memory_order_relaxed);
  const std::uint64_t taken = state.home_taken.load(std::memory_order_acquire);
  state.home_wanted.store(taken + (state.config.home_on_engage ? 1 : 0), std::memory_order_release);
  state.watchdog.start();
  register_cut(state);
  state.engagement.fetch_add(1, std::memory_order_release);
  state.engaged.store(true, std::memory_order_release);
  return std::nullopt;
}

void PhantomDevice::disengage() noexcept {
  State& state = *state_;
  const std::lock_guard lock(state.engage_mutex);
  // Also after a cut at exit, which does not release the rest.
  forget_cut(state);
  state.watchdog.stop();
  const bool was_engaged = state.engaged.exchange(false, std::memory_order_acq_rel);
  state.homed.store(false, std::memory_order_release);
  if (!was_engaged) return;
  state.board->write_volts(kZeroVolts);
  state.board->release(daq::BoardUse::kMotion);
}

std::optional<hal::Error> PhantomDevice::home() {
  State& state = *state_;
  if (!state.engaged.load(std::memory_order_acquire)) {
    return hal::Error{"the device is not engaged", "haptic device", "", "",
                      "load a scene that needs it, then put the arm in its reset pose and home it"};
  }
  state.home_wanted.fetch_add(1, std::memory_order_acq_rel);
  return std::nullopt;
}

void PhantomDevice::read(hal::RigSample& sample) noexcept {
  State& state = *state_;
  std::uint32_t status = 0;
  if (!state.engaged.load(std::memory_order_acquire)) {
    status = status_bit::kDeviceNotReady;
  } else {
    state.restart();
    const std::int64_t now_ns = state.board->now_ns();
    state.counters_fail = !state.board->read_counters(std::span(state.counts).first(state.encoders));
    if (state.counters_fail) {
      state.counter_failures.fetch_add(1, std::memory_order_relaxed);
    } else {
      state.follow(now_ns);
    }
    if (!state.is_home) status |= status_bit::kDeviceNotReady;
    const std::uint32_t trouble = state.troubles();
    if (trouble != 0) status |= status_bit::kDeviceFault;
    if (state.is_home && !state.jumped && state.motion.over_speed()) status |= status_bit::kDeviceOverSpeed;
    if (state.over_force) status |= status_bit::kDeviceOverForce;
    for (const WindingHeat& heat : state.heat) {
      if (heat.warm()) status |= status_bit::kDeviceWarm;
    }
    if (state.watchdog.take_cut()) status |= status_bit::kCommandStale;
    state.trouble.store(trouble, std::memory_order_relaxed);
    state.homed.store(state.is_home, std::memory_order_release);
  }
  state.status.store(status, std::memory_order_relaxed);
  for (std::size_t i = 0; i < 3; ++i) state.q_reported[i].store(state.q[i], std::memory_order_relaxed);
  sample.tip_position_mm = state.tip_mm;
  sample.tip_orientation = state.turned;
  sample.position_age_ns = 0;  // the counters are read in this call
  if (state.is_home && !state.jumped) sample.max_force_n = state.force_now_n();
  sample.status |= status;
}

void PhantomDevice::write(const hal::DeviceCommand& command) noexcept {
  State& state = *state_;
  if (!state.engaged.load(std::memory_order_acquire)) return;
  state.restart();
  state.warm_up(state.board->now_ns());
  const hal::Vector3& force_n = command.force_n;
  const bool finite = std::isfinite(force_n.x) && std::isfinite(force_n.y) && std::isfinite(force_n.z);
  if (!finite) state.unfit_commands.fetch_add(1, std::memory_order_relaxed);
  // A failed output does not block commands: each command tries again, but with zero force.
  const bool allowed =
      state.is_home && state.troubles() == 0 && !state.motion.over_speed() && !state.watchdog.cut() && finite;
  state.over_force = false;
  if (allowed) {
    state.put(state.currents_within(force_n));
    if (state.over_force) state.scaled_commands.fetch_add(1, std::memory_order_relaxed);
  } else {
    state.put({});
    if (dot(force_n, force_n) != 0.0) state.withheld_commands.fetch_add(1, std::memory_order_relaxed);
  }
  state.watchdog.fed(state.board->now_ns());
}

// Once more after a short time: a tick running in another thread may still write its volts after the first
// zero.
void PhantomDevice::write_zero_in_crash() noexcept {
  State& state = *state_;
  if (!state.engaged.load(std::memory_order_acquire)) return;
  constexpr timespec kMoment{0, 2'000'000};
  state.cut_at_exit();
  nanosleep(&kMoment, nullptr);
  state.cut_at_exit();
}

hal::PartReport PhantomDevice::report() const {
  const State& state = *state_;
  hal::PartReport report;
  report.part = "haptic device";
  report.driver = "phantom";
  const bool engaged = state.engaged.load(std::memory_order_acquire);
  const bool homed = state.homed.load(std::memory_order_acquire);
  const std::uint32_t trouble = engaged ? state.trouble.load(std::memory_order_relaxed) : 0;
  const std::uint32_t status = engaged ? state.status.load(std::memory_order_relaxed) : 0;
  report.state = !engaged       ? hal::PartState::kIdle
                 : trouble != 0 ? hal::PartState::kFaulty
                 : homed        ? hal::PartState::kReady
                                : hal::PartState::kConnecting;

  const auto find = [&](bool holds, std::string text) {
    if (holds) report.findings.push_back(std::move(text));
  };
  const std::uint64_t wanted = state.home_wanted.load(std::memory_order_acquire);
  const bool homing = state.home_taken.load(std::memory_order_acquire) < wanted;
  find(engaged && homing, "homing: keep the arm still in its reset pose");
  find(engaged && !homed && !homing, "not homed: put the arm in its reset pose and home it");
  find((trouble & kCountersFail) != 0, "the encoders' counts cannot be read: check the board");
  find((trouble & kOutputsFail) != 0,
       "the board does not accept the motors' volts: switch the amplifiers off and check the board");
  find((trouble & kEncoderJumped) != 0,
       fmt::format("the encoder of joint {} has jumped: check its cable, then home the arm again",
                   state.jumped_joint.load(std::memory_order_relaxed) + 1));
  find((trouble & kBeyondStops) != 0,
       "the arm seems beyond its stops: it was not in its reset pose when homed; home it again");
  find((trouble & kTooHot) != 0, "a motor is too hot: no force until it has cooled");
  find((status & status_bit::kDeviceWarm) != 0, "a motor is warm: its force is being reduced");
  find((status & status_bit::kDeviceOverSpeed) != 0, "the tip is faster than allowed: no force");
  find((status & status_bit::kDeviceOverForce) != 0, "more force was commanded than the motors may give");

  const auto count = [&](const char* name, std::uint64_t value) {
    report.figures.push_back({name, static_cast<double>(value), ""});
  };
  for (std::size_t i = 0; i < 3; ++i) {
    report.figures.push_back(
        {fmt::format("joint_{}_rad", i + 1), state.q_reported[i].load(std::memory_order_relaxed), "rad"});
  }
  for (std::size_t i = 0; i < 3; ++i) {
    report.figures.push_back(
        {fmt::format("winding_{}_heat", i + 1), state.reported_heat[i].load(std::memory_order_relaxed), "1"});
  }
  count("watchdog_cuts", state.watchdog.cuts());
  count("counter_failures", state.counter_failures.load(std::memory_order_relaxed));
  count("output_failures", state.output_failures.load(std::memory_order_relaxed));
  count("encoder_jumps", state.jumps.load(std::memory_order_relaxed));
  count("unfit_commands", state.unfit_commands.load(std::memory_order_relaxed));
  count("scaled_commands", state.scaled_commands.load(std::memory_order_relaxed));
  count("withheld_commands", state.withheld_commands.load(std::memory_order_relaxed));
  state.board->describe(report);
  return report;
}

}  // namespace hapticd::phantom
