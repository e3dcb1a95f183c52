#pragma once

#include <cstdint>

namespace hapticd::rt {

/// Everything that can go wrong with a rig while it renders. What follows from each is in fault_table.h.
enum class GuardFault : std::uint8_t {
  kNone,
  kStopped,            ///< someone asked for it
  kNonFinite,          ///< a measurement or a command was NaN, infinite or absurd (beyond 10 m, 10 kN)
  kSensorStale,        ///< the newest force sample is too old
  kSensorSaturated,    ///< a sensor channel is at its end
  kSensorFault,        ///< the sensor reports itself unfit
  kDeviceFault,        ///< the device is lost or reports an error
  kSensorLost,         ///< no connection to the sensor
  kSensorWarning,      ///< the sensor reports something, but is fit for use
  kDeviceNotReady,     ///< not calibrated, homed or engaged
  kDeviceWarm,         ///< motors near their thermal limit
  kDeviceOverForce,    ///< the device was asked for more than it gives
  kDeviceOverSpeed,    ///< the device moves faster than it may
  kCommandStale,       ///< commands did not reach the device in time, so that it cut the force itself
  kLoopGap,            ///< too long between two ticks: the last force stayed on meanwhile
  kTurntableMoving,    ///< the table turns while the tool touches or the device renders
  kTurntableLost,      ///< no word from the table while it turns
  kTurntableStalled,   ///< commanded to move, it does not
  kTurntableTimedOut,  ///< a motion did not end in time
  kTurntableAlarm,     ///< its drive reports an alarm
  kOscillation,        ///< the command goes back and forth faster than a hand can and gives energy
  kSensorZeroFar,      ///< the sensor's zero has drifted half as far from its bias as it is followed
  kSensorZeroLost,     ///< it has drifted as far as it is followed
  kClientLost,         ///< the client that controls the rig was not heard of for too long
  kEndpointMissing,    ///< an endpoint of the watchdog does not check in
  kPedalReleased,      ///< one reports that its pedal is released
  kUncleanEnd,         ///< the last run of the daemon did not end cleanly, and the fault was not cleared
                       ///< since
  kSensorJumped,       ///< the sensor's reading jumped, and nothing has shown since that the tool is free
  kSensorFrozen,       ///< the sensor repeats an old value although its samples go on
  kStructureSwings,    ///< the contact swings with the device's structure: less of it is compensated
};

}  // namespace hapticd::rt
