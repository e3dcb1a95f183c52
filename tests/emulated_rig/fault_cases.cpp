#include "tests/emulated_rig/fault_cases.h"

#include <chrono>
#include <limits>
#include <memory>
#include <thread>
#include <utility>

namespace hapticd::test {

namespace {

using rt::GuardFault;

rt::SceneSpec stiffer() {
  rt::SceneSpec scene;
  scene.name = "tap_1d";
  scene.target.stiffness_n_per_mm = 0.7;
  return scene;
}

// -- live

/// Puts nothing down to the machine any more from the fault on, until it is over.
std::function<void()> unforgiving(EmulatedRig& rig, std::function<void()> make) {
  rig.forgive_stalls(true);
  return [&rig, make = std::move(make)] {
    rig.forgive_stalls(false);
    make();
  };
}

/// Made between two ticks: the next one could know.
FaultPlan between_ticks(EmulatedRig& rig, GuardFault fault, std::function<void()> make,
                        std::function<void()> fix) {
  rig.forgive_stalls(true);  // none of them is the device's
  FaultPlan plan;
  plan.fault = fault;
  plan.live = true;
  plan.inject = [&rig, make = std::move(make)] { rig.rig().after_write(make); };
  plan.aware = [&rig]() -> std::optional<std::uint64_t> {
    const auto done = rig.rig().done_after();
    if (!done) return std::nullopt;
    return *done + 1;
  };
  plan.fix = std::move(fix);
  plan.lasts = plan.fix != nullptr;
  return plan;
}

/// Made with a record: the first tick that begins after that was sent could know; or, if the records cease,
/// the first that found none.
FaultPlan with_a_record(EmulatedRig& rig, GuardFault fault, bool silent, std::function<void()> make,
                        std::function<void()> fix) {
  FaultPlan plan;
  plan.fault = fault;
  plan.live = true;
  plan.inject = [&rig, make = unforgiving(rig, std::move(make))] { rig.before_record(make); };
  plan.settled = [&rig] { rig.forgive_stalls(true); };
  plan.aware = [&rig, silent]() -> std::optional<std::uint64_t> {
    const auto sent_ns = rig.sent_ns();
    if (!sent_ns) return std::nullopt;
    for (std::size_t tick = rig.rig().marks(); tick-- > 0;) {
      if (rig.rig().mark(tick).monotonic_ns >= *sent_ns) continue;
      std::uint64_t first = tick + 1;
      while (silent) {
        if (first > rig.last().tick) return std::nullopt;
        if (rig.records()[rig.place_of(first)].force_count == 0) break;
        ++first;
      }
      return first;
    }
    return std::nullopt;
  };
  plan.fix = std::move(fix);
  plan.lasts = plan.fix != nullptr;
  return plan;
}

template <std::uint32_t kStatus, GuardFault kFault>
FaultPlan status_word(EmulatedRig& rig) {
  return with_a_record(
      rig, kFault, false, [&rig] { rig.box().set_status(kStatus); }, [&rig] { rig.box().set_status(0); });
}

template <std::uint32_t kError, GuardFault kFault>
FaultPlan frame_error(EmulatedRig& rig) {
  return between_ticks(
      rig, kFault,
      [&rig] {
        rig.page().device().frame_error = kError;
        rig.page().device().frame_error_frames = 1;
      },
      nullptr);
}

template <std::uint32_t kMs, GuardFault kFault>
FaultPlan scheduler_stall(EmulatedRig& rig) {
  FaultPlan plan = between_ticks(
      rig, kFault, [&rig] { rig.page()->stall_ms = kMs; }, nullptr);
  plan.stalls = true;
  return plan;
}

FaultPlan silence(EmulatedRig& rig) {
  return with_a_record(
      rig, GuardFault::kSensorStale, true, [&rig] { rig.box().set_silent(true); },
      [&rig] { rig.box().set_silent(false); });
}
FaultPlan stream_taken(EmulatedRig& rig) {
  FaultPlan plan = with_a_record(
      rig, GuardFault::kSensorLost, true,
      [&rig] {
        rig.box().set_deaf(true);
        rig.box().give_stream_away();
      },
      [&rig] { rig.box().set_deaf(false); });
  plan.first = GuardFault::kSensorStale;
  return plan;
}
FaultPlan saturated_counts(EmulatedRig& rig) {
  return with_a_record(
      rig, GuardFault::kSensorSaturated, false,
      [&rig] { rig.box().saturate_counts(std::numeric_limits<std::int32_t>::max()); },
      [&rig] { rig.box().saturate_counts(std::nullopt); });
}
FaultPlan box_restart(EmulatedRig& rig) {
  return with_a_record(
      rig, GuardFault::kSensorStale, true, [&rig] { rig.box().restart(0.5); }, nullptr);
}
/// A field of the device that is wrong for a while.
template <auto kField, auto kWrong, auto kSound, GuardFault kFault>
FaultPlan device_field(EmulatedRig& rig) {
  return between_ticks(
      rig, kFault, [&rig] { rig.page().device().*kField = kWrong; },
      [&rig] { rig.page().device().*kField = kSound; });
}
FaultPlan warm_motors(EmulatedRig& rig) {
  return between_ticks(
      rig, GuardFault::kDeviceWarm, [&rig] { rig.page().device().motor_temperature[1] = 0.95; },
      [&rig] { rig.page().device().motor_temperature[1] = 0.2; });
}

// -- board

FaultPlan between_ticks(BoardRig& rig, GuardFault fault, std::function<void()> make,
                        std::function<void()> fix, std::uint64_t ticks_later = 1) {
  FaultPlan plan;
  plan.fault = fault;
  plan.inject = [&rig, make = std::move(make)] { rig.rig().after_write(make); };
  plan.aware = [&rig, ticks_later]() -> std::optional<std::uint64_t> {
    const auto done = rig.rig().done_after();
    if (!done) return std::nullopt;
    return *done + ticks_later;
  };
  plan.fix = std::move(fix);
  plan.lasts = plan.fix != nullptr;
  return plan;
}

/// A fault of the board that is switched on and off.
template <auto kSwitch, GuardFault kFault>
FaultPlan board_switch(BoardRig& rig) {
  return between_ticks(
      rig, kFault, [&rig] { (rig.board().*kSwitch)(true); }, [&rig] { (rig.board().*kSwitch)(false); });
}
FaultPlan gauge_nan(BoardRig& rig) {
  return between_ticks(
      rig, GuardFault::kSensorFault, [&rig] { rig.board().put_nan(); },
      [&rig] { rig.board().repair_gauges(); });
}
FaultPlan gauge_at_rail(BoardRig& rig) {
  return between_ticks(
      rig, GuardFault::kSensorSaturated, [&rig] { rig.board().put_rail(2, 10.0); },
      [&rig] { rig.board().repair_gauges(); });
}
FaultPlan scans_lost(BoardRig& rig) {
  return between_ticks(
      rig, GuardFault::kSensorWarning, [&rig] { rig.board().lose_scans(4); }, nullptr);
}
FaultPlan encoder_jump(BoardRig& rig) {
  return between_ticks(
      rig, GuardFault::kDeviceFault, [&rig] { rig.board().jump_encoder(1, 2500); },
      [&rig] {
        // Put into the reset pose, where the hand is at home, and homed.
        rig.set_hand({});
        rig.pass(1.5);
        rig.device().home();
      });
}
FaultPlan outputs_fail(BoardRig& rig) {
  // The write of the next tick is the first that fails, and the sample after it the first to know.
  FaultPlan plan = between_ticks(
      rig, GuardFault::kDeviceFault, [&rig] { rig.board().fail_outputs(); },
      [&rig] { rig.board().fail_outputs(false); }, 2);
  plan.device_obeys = false;
  return plan;
}
FaultPlan board_gone(BoardRig& rig) {
  FaultPlan plan = between_ticks(
      rig, GuardFault::kDeviceFault, [&rig] { rig.board().vanish(); }, [&rig] { rig.board().vanish(false); });
  plan.device_obeys = false;
  return plan;
}
FaultPlan no_commands(BoardRig& rig) {
  FaultPlan plan;
  plan.fault = GuardFault::kCommandStale;
  const auto aware = std::make_shared<std::optional<std::uint64_t>>();
  plan.inject = [&rig, aware] {
    *aware = rig.last().tick + 1;
    rig.pass_without_tick(0.025);
    // The watchdog has its own thread, which looks at the board's time.
    for (int k = 0; k < 10'000 && rig.output_n() != 0.0; ++k) {
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
  };
  plan.aware = [aware] { return *aware; };
  plan.lasts = false;
  return plan;
}

// -- without a peer

template <GuardFault kFault>
FaultPlan raised(BoardRig& rig) {
  return between_ticks(
      rig, kFault, [&rig] { rig.engine().raise(kFault); }, nullptr);
}
FaultPlan nan_in_sample(BoardRig& rig) {
  return between_ticks(
      rig, GuardFault::kNonFinite,
      [&rig] {
        rig.tamper([](hal::RigSample& sample) {
          sample.sensor_force_n.z = std::numeric_limits<double>::quiet_NaN();
        });
      },
      [&rig] { rig.tamper({}); });
}
FaultPlan absurd_position(BoardRig& rig) {
  return between_ticks(
      rig, GuardFault::kNonFinite,
      [&rig] { rig.tamper([](hal::RigSample& sample) { sample.tip_position_mm.x = 1e30; }); },
      [&rig] { rig.tamper({}); });
}
FaultPlan time_jump(BoardRig& rig) {
  return between_ticks(
      rig, GuardFault::kLoopGap,
      [&rig] { rig.tamper([](hal::RigSample& sample) { sample.time_ns += 60'000'000; }); }, nullptr);
}

}  // namespace

const std::vector<FaultCase<EmulatedRig>>& live_fault_cases() {
  using enum GuardFault;
  using Device = emulators::HdPageDevice;
  static const std::vector<FaultCase<EmulatedRig>> all{
      {"silence", "netft", "sends nothing any more", kSensorStale, silence},
      {"stream_taken", "netft", "sends to someone else and takes no request", kSensorLost, stream_taken},
      {"restart", "netft", "restarts, 0.5 s away", kSensorStale, box_restart},
      {"saturated_counts", "netft", "all counts at 2^31 - 1", kSensorSaturated, saturated_counts},
      {"status_saturated", "netft", "status bit 17", kSensorSaturated,
       status_word<0x80020000, kSensorSaturated>},
      {"status_cpu", "netft", "status bit 30", kSensorFault, status_word<0xC0000000, kSensorFault>},
      {"status_calibration", "netft", "status bit 23", kSensorFault, status_word<0x80800000, kSensorFault>},
      {"status_excitation", "netft", "status bit 9", kSensorFault, status_word<0x80000200, kSensorFault>},
      {"status_link", "netft", "status bit 4", kSensorFault, status_word<0x80000010, kSensorFault>},
      {"status_summary", "netft", "status bit 31 alone", kSensorFault, status_word<0x80000000, kSensorFault>},
      {"condition_latched", "netft", "status bit 16", kSensorWarning,
       status_word<0x80010000, kSensorWarning>},
      {"unplugged", "openhaptics", "communication error in every frame", kDeviceFault,
       device_field<&Device::unplugged, true, false, kDeviceFault>},
      {"nan_position", "openhaptics", "HD_CURRENT_POSITION is NaN", kDeviceFault,
       device_field<&Device::position_is_nan, true, false, kDeviceFault>},
      {"nan_transform", "openhaptics", "HD_CURRENT_TRANSFORM is NaN", kDeviceFault,
       device_field<&Device::transform_is_nan, true, false, kDeviceFault>},
      {"force_error", "openhaptics", "HD_FORCE_ERROR once", kDeviceFault, frame_error<0x204, kDeviceFault>},
      {"exceeded_force", "openhaptics", "HD_EXCEEDED_MAX_FORCE once", kDeviceOverForce,
       frame_error<0x201, kDeviceOverForce>},
      {"exceeded_impulse", "openhaptics", "HD_EXCEEDED_MAX_FORCE_IMPULSE once", kDeviceOverForce,
       frame_error<0x202, kDeviceOverForce>},
      {"exceeded_velocity", "openhaptics", "HD_EXCEEDED_MAX_VELOCITY once", kDeviceOverSpeed,
       frame_error<0x203, kDeviceOverSpeed>},
      {"warm_error", "openhaptics", "HD_WARM_MOTORS once", kDeviceWarm, frame_error<0x200, kDeviceWarm>},
      {"warm_motors", "openhaptics", "a motor at 0.95 of what it bears", kDeviceWarm, warm_motors},
      {"calibration_lost", "openhaptics", "calibration needs manual input", kDeviceNotReady,
       device_field<&Device::calibration_state, 0x5002U, 0x5000U, kDeviceNotReady>},
      {"output_off", "openhaptics", "switches its force output off", kDeviceNotReady,
       device_field<&Device::force_enabled, false, true, kDeviceNotReady>},
      {"stall_70_ms", "openhaptics", "scheduler pauses 70 ms", kLoopGap, scheduler_stall<70, kLoopGap>},
      {"stall_150_ms", "openhaptics", "scheduler pauses 150 ms", kDeviceFault,
       scheduler_stall<150, kDeviceFault>},
  };
  return all;
}

const std::vector<FaultCase<BoardRig>>& board_fault_cases() {
  using enum GuardFault;
  using Board = emulators::ScriptedBoard;
  static const std::vector<FaultCase<BoardRig>> all{
      {"gauge_at_rail", "board", "a gauge at 10 V", kSensorSaturated, gauge_at_rail},
      {"gauge_nan", "board", "gauges read NaN", kSensorFault, gauge_nan},
      {"acquisition_stopped", "board", "acquisition stops, and says so", kSensorLost,
       board_switch<&Board::stop_scans, kSensorLost>},
      {"scans_mute", "board", "no scans any more", kSensorStale,
       board_switch<&Board::mute_scans, kSensorStale>},
      {"scans_lost", "board", "four scans lost", kSensorWarning, scans_lost},
      {"encoder_jump", "board", "an encoder jumps by 2500 counts", kDeviceFault, encoder_jump},
      {"counters_fail", "board", "counters cannot be read", kDeviceFault,
       board_switch<&Board::fail_counters, kDeviceFault>},
      {"outputs_fail", "board", "outputs take nothing", kDeviceFault, outputs_fail},
      {"board_gone", "board", "the whole board vanishes", kDeviceFault, board_gone},
      {"no_commands", "board", "no command for 25 ms", kCommandStale, no_commands},
      {"stop", "engine", "stop", kStopped, raised<kStopped>},
      {"nan_force", "engine", "a force that is NaN", kNonFinite, nan_in_sample},
      {"absurd_position", "engine", "a position of 1e30 mm", kNonFinite, absurd_position},
      {"loop_gap", "engine", "60 ms between two ticks", kLoopGap, time_jump},
      {"turntable_moving", "turntable", "turns in contact", kTurntableMoving, raised<kTurntableMoving>},
      {"turntable_lost", "turntable", "silent while it turns", kTurntableLost, raised<kTurntableLost>},
      {"turntable_stalled", "turntable", "does not move", kTurntableStalled, raised<kTurntableStalled>},
      {"turntable_timed_out", "turntable", "does not arrive", kTurntableTimedOut, raised<kTurntableTimedOut>},
      {"turntable_alarm", "turntable", "reports an alarm", kTurntableAlarm, raised<kTurntableAlarm>},
  };
  return all;
}

EmulatedRigConfig rig_for_faults(const FaultTimeout& timeout) {
  EmulatedRigConfig config;
  config.scene = stiffer();
  config.scene.guard.sensor_stale_after_ms = timeout.sensor_stale_after_ms;
  config.scene.guard.loop_gap_ms = timeout.loop_gap_ms;
  config.stall_s = timeout.stall_s;
  config.fifo_priority = timeout.fifo_priority;
  return config;
}

RunConfig board_for_faults() {
  RunConfig config;
  config.scene = stiffer();
  return config;
}

}  // namespace hapticd::test
