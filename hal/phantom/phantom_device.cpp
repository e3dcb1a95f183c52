#include "hal/phantom/phantom_device.h"

#include <fmt/format.h>
#include <time.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>

#include "hal/monotonic_clock.h"
#include "hal/phantom/phantom_state.h"

namespace hapticd::phantom {

namespace {

namespace status_bit = hal::sample_status;

}  // namespace

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
  const MutexLock lock(state.engage_mutex);
  if (state.engaged.load(std::memory_order_acquire)) return std::nullopt;
  if (auto error = state.board->engage(daq::BoardUse::kMotion)) return error;
  // The loop does not tick yet, so this thread may try what the tick will do.
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
  state.last_trouble.store(0, std::memory_order_relaxed);
  state.status.store(status_bit::kDeviceNotReady, std::memory_order_relaxed);
  const std::uint64_t taken = state.home_taken.load(std::memory_order_acquire);
  state.home_wanted.store(taken + (state.config.home_on_engage ? 1 : 0), std::memory_order_release);
  state.watchdog.start();
  register_cut(state_);
  state.engagement.fetch_add(1, std::memory_order_release);
  state.engaged.store(true, std::memory_order_release);
  return std::nullopt;
}

void PhantomDevice::disengage() noexcept {
  State& state = *state_;
  const MutexLock lock(state.engage_mutex);
  // Also after a cut at exit, which does not release the rest.
  forget_cut(state_);
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
    if (trouble != 0) {
      status |= status_bit::kDeviceFault;
      state.last_trouble.store(trouble, std::memory_order_relaxed);
      state.last_trouble_ns.store(hal::monotonic_ns(), std::memory_order_relaxed);
    }
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
  sample.angles = {state.q, state.gimbal_rad, state.is_home};
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

}  // namespace hapticd::phantom
