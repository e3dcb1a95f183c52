#include "hal/phantom/phantom_state.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace hapticd::phantom {

namespace {

using Counts = std::array<std::int64_t, 3>;

constexpr std::int64_t kStillCounts = 3;
/// Motors warm up between the reading of their limit and the command: a shortfall up to this share is not
/// reported.
constexpr double kAsAsked = 0.99;
constexpr double kRadPerTurn = 2.0 * std::numbers::pi;

}  // namespace

// Restarts after the board was engaged again: the counters started from somewhere, so nothing is known of the
// pose.
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
  // Old or new cannot be known: the hotter counts.
  for (std::size_t i = 0; i < 3; ++i) held_a[i] = std::max(std::abs(held_a[i]), std::abs(current_a[i]));
}

void PhantomDevice::State::cut_at_exit() noexcept {
  engaged.store(false, std::memory_order_release);
  board->write_volts(kZeroVolts);
}

}  // namespace hapticd::phantom
