#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

#include "hal/samples.h"
#include "rt/record/fault.h"

namespace hapticd::rt {

/// What the guard does about a fault, the mildest first.
enum class FaultAction : std::uint8_t {
  kWarn,        ///< reported; force goes on
  kRampToZero,  ///< force falls to zero over GuardLimits::fall_ramp_s
  kCut,         ///< zero from this very tick on
};

/// Event that ends what a fault began. However it ends, force comes back from zero over
/// GuardLimits::resume_ramp_s.
enum class FaultClearing : std::uint8_t {
  kItself,     ///< over when its cause is
  kAnyClient,  ///< latched until someone clears (SafetyService.Clear), and refused while the cause lasts
};

/// One line of the table. The guard is driven by it and knows no fault by name.
struct FaultRule {
  GuardFault fault;
  std::string_view name;   ///< as in telemetry, without its prefix
  std::string_view cause;  ///< how it is noticed
  FaultAction action;
  FaultClearing clearing;
  bool unfit;  ///< the sample may not enter a pipeline: its filters would be poisoned
  /// The pipeline starts again: what it estimated is forgotten before the next fit sample, contact is
  /// declared only once the tool was seen free. Kept: target and its ramp, the sensor's zero, counts of
  /// contacts, motors' heat.
  bool restarts;
  bool of_sensor;               ///< only of interest where the scene listens to the force sensor
  std::uint32_t sample_status;  ///< bits of hal::sample_status that mean this fault; 0 = noticed otherwise
  std::string_view remedy;
};

namespace fault_table_detail {
inline constexpr auto kWarn = FaultAction::kWarn;
inline constexpr auto kRamp = FaultAction::kRampToZero;
inline constexpr auto kCut = FaultAction::kCut;
inline constexpr auto kItself = FaultClearing::kItself;
inline constexpr auto kAnyClient = FaultClearing::kAnyClient;
namespace status = hal::sample_status;
}  // namespace fault_table_detail

// clang-format off
/// All faults, in the order of GuardFault.
inline constexpr auto kFaultTable = [] {
  using namespace fault_table_detail;
  using enum GuardFault;
  return std::array{
    FaultRule{kStopped, "stopped", "someone asked for it", kCut, kAnyClient, false, true, false, 0,
              "clear when the reason is gone"},
    FaultRule{kNonFinite, "non_finite", "a measurement or a command is NaN, infinite or absurd", kCut, kAnyClient, true, true, false, 0,
              "see in the telemetry which one; if it comes back, report it"},
    FaultRule{kSensorStale, "sensor_stale", "the newest force sample is older than guard.sensor_stale_after_ms", kCut, kAnyClient, true, true, true, 0,
              "look at the sensor's link and rate (hapticctl doctor)"},
    FaultRule{kSensorSaturated, "sensor_saturated", "a sensor channel is at the end of its range", kCut, kAnyClient, true, true, true, status::kForceSaturated,
              "take the load off; press less hard or use a sensor of more range"},
    FaultRule{kSensorFault, "sensor_fault", "the sensor reports itself unfit", kCut, kAnyClient, true, true, true, status::kForceFault,
              "hapticctl doctor names the bit; check cable, supply and transducer"},
    FaultRule{kDeviceFault, "device_fault", "the device is lost or reports an error", kCut, kAnyClient, true, true, false, status::kDeviceFault,
              "hapticctl doctor names the error; check cable and supply, then start again"},
    FaultRule{kSensorLost, "sensor_lost", "no connection to the sensor", kCut, kAnyClient, true, true, true, status::kForceLost,
              "check cable, address and supply; the driver keeps trying"},
    FaultRule{kSensorWarning, "sensor_warning", "the sensor reports something, but is fit for use", kWarn, kItself, false, false, true, status::kForceWarning,
              "hapticctl doctor names it"},
    FaultRule{kDeviceNotReady, "device_not_ready", "the device is not calibrated, homed or engaged", kCut, kAnyClient, true, true, false, status::kDeviceNotReady,
              "put the arm into its reset pose and home it"},
    FaultRule{kDeviceWarm, "device_warm", "motors near their thermal limit", kRamp, kAnyClient, false, false, false, status::kDeviceWarm,
              "let the motors cool; use lower targets or shorter contacts"},
    FaultRule{kDeviceOverForce, "device_over_force", "the device was asked for more than it gives", kCut, kAnyClient, false, true, false, status::kDeviceOverForce,
              "lower guard.max_force_n to what the device allows"},
    FaultRule{kDeviceOverSpeed, "device_over_speed", "the device moves faster than it may", kCut, kAnyClient, false, true, false, status::kDeviceOverSpeed,
              "move more slowly; if no one moved it, lower the gains"},
    FaultRule{kCommandStale, "command_stale", "commands did not reach the device in time; it cut the force itself", kCut, kItself, false, true, false, status::kCommandStale,
              "see why the loop was late (hapticctl doctor)"},
    FaultRule{kLoopGap, "loop_gap", "more than guard.loop_gap_ms between two ticks", kCut, kItself, false, true, false, 0,
              "see in hapticctl status what took the time; hapticctl doctor says how to set up the machine"},
    FaultRule{kTurntableMoving, "turntable_moving", "the table turns while the tool touches or the device renders", kCut, kAnyClient, false, true, false, 0,
              "lift the tool; look why the table turned"},
    FaultRule{kTurntableLost, "turntable_lost", "no word from the table while it turns", kCut, kAnyClient, false, true, false, 0,
              "check the link, then home the table"},
    FaultRule{kTurntableStalled, "turntable_stalled", "commanded to move, the table does not", kWarn, kItself, false, false, false, 0,
              "free the table, then hapticctl turntable clear"},
    FaultRule{kTurntableTimedOut, "turntable_timed_out", "a motion of the table did not end in time, or not where it should", kWarn, kItself, false, false, false, 0,
              "check load and speed limit, then hapticctl turntable clear"},
    FaultRule{kTurntableAlarm, "turntable_alarm", "the table's drive reports an alarm or refuses an order", kWarn, kItself, false, false, false, 0,
              "hapticctl turntable status names it; fix it, then hapticctl turntable clear"},
    FaultRule{kOscillation, "oscillation", "the command goes back and forth faster than a hand can, and gives energy", kCut, kAnyClient, false, true, false, 0,
              "lower the target or the gains; hold the tool more firmly"},
    FaultRule{kSensorZeroFar, "sensor_zero_far", "the sensor's zero has drifted by half of contact.zero_bound_n since its bias, or it reads something in 2 s of motion, or a load comes that is not rendered, while a free tool is waited for, or it is so noisy that contacts are missed", kWarn, kItself, false, false, true, 0,
              "bias the sensor when the tool is free and at rest (hapticctl sensor bias); if it is noisy, see to its cable and shield"},
    FaultRule{kSensorZeroLost, "sensor_zero_lost", "the sensor's zero has drifted by contact.zero_bound_n since its bias", kCut, kAnyClient, false, true, true, 0,
              "bias the sensor with the tool free and at rest (hapticctl sensor bias), then clear"},
    FaultRule{kClientLost, "client_lost", "the holder of the lease was not heard of for its time to live", kRamp, kAnyClient, false, false, false, 0,
              "see to the client and its connection, then clear"},
    FaultRule{kEndpointMissing, "endpoint_missing", "an endpoint of the watchdog does not check in", kRamp, kAnyClient, false, false, false, 0,
              "see in hapticctl status which one, and start it"},
    FaultRule{kPedalReleased, "pedal_released", "an endpoint of the watchdog reports its pedal released", kCut, kAnyClient, false, true, false, 0,
              "press the pedal"},
    FaultRule{kUncleanEnd, "unclean_end", "the last run of the daemon did not end cleanly: a crash, a kill, a loss of power", kCut, kAnyClient, false, true, false, 0,
              "read in the log why it ended; hold the tool in free air, then clear"},
    FaultRule{kSensorJumped, "sensor_jumped", "the sensor's reading jumped without a load, or several times under one, and the tool has not been moved in free air since", kWarn, kItself, false, false, true, 0,
              "move the tool by some millimetres in free air; if it comes back, look who biases the sensor, and at cable and transducer"},
    FaultRule{kSensorFrozen, "sensor_frozen", "the sensor repeats one value although the tool moves and its samples go on", kCut, kAnyClient, true, true, true, 0,
              "start the sensor's box or its acquisition again; see to the cable between them"},
    FaultRule{kStructureSwings, "structure_swings", "a contact swung with the device's structure, so that less of the structure is compensated and the object feels harder than granted, until the next target", kWarn, kItself, false, false, true, 0,
              "set a target that is nearer to the object's own stiffness, or the same again if something else shook the object; identify the structure (hapticctl identify structural)"},
  };
}();
// clang-format on

/// A set of faults: bit n is the fault of number n.
using FaultSet = std::uint32_t;
constexpr FaultSet set_of(GuardFault fault) noexcept {
  return fault == GuardFault::kNone ? 0 : FaultSet{1} << static_cast<unsigned>(fault);
}
/// All faults whose rule fulfils a condition.
template <class Condition>
constexpr FaultSet faults_that(Condition condition) noexcept {
  FaultSet set = 0;
  for (const FaultRule& rule : kFaultTable) set |= condition(rule) ? set_of(rule.fault) : 0;
  return set;
}
/// The fault's line; `fault` is not kNone.
constexpr const FaultRule& rule_of(GuardFault fault) noexcept {
  return kFaultTable[static_cast<std::size_t>(fault) - 1];
}
static_assert(
    [] {
      for (std::size_t i = 0; i < kFaultTable.size(); ++i) {
        if (static_cast<std::size_t>(kFaultTable[i].fault) != i + 1) return false;
      }
      return kFaultTable.back().fault == GuardFault::kStructureSwings;
    }(),
    "one line a fault, in the order of GuardFault");
static_assert(faults_that([](const FaultRule& r) { return r.restarts != (r.action == FaultAction::kCut); }) ==
                      0 &&
                  faults_that([](const FaultRule& r) { return r.unfit && !r.restarts; }) == 0,
              "after a cut nothing goes on from before it");

std::string_view to_text(FaultAction action) noexcept;
std::string_view to_text(FaultClearing clearing) noexcept;
/// The table as docs/faults.md prints it.
std::string fault_table_markdown();

}  // namespace hapticd::rt
