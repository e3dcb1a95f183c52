#pragma once

#include <cstdint>

/// The part of the OpenHaptics HD interface this driver uses, declared here because the vendor's library is
/// only loaded at run time. Types, values and call order follow the vendor's published API reference (3.0
/// to 3.5); the values were compared one by one with public listings.
namespace hapticd::openhaptics::hd {

using Enum = unsigned int;
using ErrorCode = unsigned int;
using Handle = unsigned int;  ///< of a device
using Boolean = unsigned char;
using CallbackCode = unsigned int;
using SchedulerHandle = unsigned long;
using Callback = CallbackCode (*)(void* user);

/// Returned by value, twelve bytes: two registers on x86-64.
struct ErrorInfo {
  ErrorCode code;
  int internal_code;  ///< the device driver's own
  Handle device;      ///< current when the error occurred
};
static_assert(sizeof(ErrorInfo) == 12);

inline constexpr Handle kInvalidHandle = 0xFFFFFFFF;
inline constexpr CallbackCode kCallbackDone = 0;
inline constexpr CallbackCode kCallbackContinue = 1;
inline constexpr unsigned short kMaxPriority = 0xFFFF;

// -- errors
inline constexpr ErrorCode kSuccess = 0x0000;
inline constexpr ErrorCode kInvalidEnum = 0x0100;
inline constexpr ErrorCode kInvalidValue = 0x0101;
inline constexpr ErrorCode kInvalidOperation = 0x0102;
inline constexpr ErrorCode kInvalidInputType = 0x0103;
inline constexpr ErrorCode kBadHandle = 0x0104;
inline constexpr ErrorCode kWarmMotors = 0x0200;
inline constexpr ErrorCode kExceededMaxForce = 0x0201;
inline constexpr ErrorCode kExceededMaxForceImpulse = 0x0202;
inline constexpr ErrorCode kExceededMaxVelocity = 0x0203;
inline constexpr ErrorCode kForceError = 0x0204;
inline constexpr ErrorCode kDeviceFault = 0x0300;
inline constexpr ErrorCode kDeviceAlreadyInitiated = 0x0301;
inline constexpr ErrorCode kCommError = 0x0302;
inline constexpr ErrorCode kCommConfigError = 0x0303;
inline constexpr ErrorCode kTimerError = 0x0304;
inline constexpr ErrorCode kIllegalBegin = 0x0400;
inline constexpr ErrorCode kIllegalEnd = 0x0401;
inline constexpr ErrorCode kFrameError = 0x0402;
inline constexpr ErrorCode kInvalidPriority = 0x0500;
inline constexpr ErrorCode kSchedulerFull = 0x0501;
inline constexpr ErrorCode kInvalidLicense = 0x0600;

// -- parameters that can be read and set
inline constexpr Enum kCurrentPosition = 0x2050;      ///< 3 doubles, mm
inline constexpr Enum kCurrentTransform = 0x2052;     ///< 16 doubles, column by column
inline constexpr Enum kCurrentJointAngles = 0x2100;   ///< 3 doubles, rad
inline constexpr Enum kCurrentGimbalAngles = 0x2150;  ///< 3 doubles, rad
inline constexpr Enum kDeviceModelType = 0x2501;      ///< string
inline constexpr Enum kDeviceDriverVersion = 0x2502;
inline constexpr Enum kDeviceVendor = 0x2503;
inline constexpr Enum kDeviceSerialNumber = 0x2504;
inline constexpr Enum kOutputDof = 0x2554;                  ///< integer
inline constexpr Enum kCalibrationStyle = 0x2555;           ///< integer, bits below
inline constexpr Enum kNominalMaxStiffness = 0x2602;        ///< double, N/mm
inline constexpr Enum kNominalMaxForce = 0x2603;            ///< double, N
inline constexpr Enum kNominalMaxContinuousForce = 0x2604;  ///< double, N
inline constexpr Enum kMotorTemperature = 0x2605;  ///< one double per motor, 0 … 1 of the rated temperature
inline constexpr Enum kForceRampingRate = 0x2608;  ///< double, N/s
inline constexpr Enum kCurrentForce = 0x2700;      ///< 3 doubles, N

// -- capabilities that can be switched
inline constexpr Enum kForceOutput = 0x4000;
inline constexpr Enum kMaxForceClamping = 0x4001;
inline constexpr Enum kForceRamping = 0x4002;
inline constexpr Enum kSoftwareForceLimit = 0x4003;

// -- calibration
inline constexpr Enum kCalibrationOk = 0x5000;
inline constexpr Enum kCalibrationNeedsUpdate = 0x5001;
inline constexpr Enum kCalibrationNeedsManualInput = 0x5002;
inline constexpr int kCalibrationEncoderReset = 1 << 0;
inline constexpr int kCalibrationAuto = 1 << 1;
inline constexpr int kCalibrationInkwell = 1 << 2;

/// The library's functions. Those marked optional are null if a release lacks them.
struct Api {
  Handle (*init_device)(const char* name) = nullptr;
  void (*disable_device)(Handle) = nullptr;
  void (*begin_frame)(Handle) = nullptr;
  void (*end_frame)(Handle) = nullptr;
  ErrorInfo (*get_error)() = nullptr;
  void (*enable)(Enum) = nullptr;
  void (*disable)(Enum) = nullptr;
  void (*get_doublev)(Enum, double*) = nullptr;
  void (*set_doublev)(Enum, const double*) = nullptr;
  SchedulerHandle (*schedule_asynchronous)(Callback, void* user, unsigned short priority) = nullptr;
  void (*unschedule)(SchedulerHandle) = nullptr;
  void (*start_scheduler)() = nullptr;
  void (*stop_scheduler)() = nullptr;
  void (*set_scheduler_rate)(unsigned long hz) = nullptr;

  void (*make_current_device)(Handle) = nullptr;         ///< optional: a single device
  Boolean (*is_enabled)(Enum) = nullptr;                 ///< optional
  void (*get_integerv)(Enum, int*) = nullptr;            ///< optional
  const char* (*get_string)(Enum) = nullptr;             ///< optional
  const char* (*get_error_string)(ErrorCode) = nullptr;  ///< optional
  Enum (*check_calibration)() = nullptr;                 ///< optional: taken as calibrated
  void (*update_calibration)(Enum style) = nullptr;      ///< optional
};

}  // namespace hapticd::openhaptics::hd
