#include "hal/openhaptics/hd_errors.h"

#include "hal/samples.h"

namespace hapticd::openhaptics {

namespace {

using namespace hal::sample_status;

constexpr std::string_view kReport = "report it with the version of the vendor's library";
constexpr std::string_view kPlug = "check cable and power, then engage the device again";

constexpr std::array<HdError, kHdErrorCount> kErrors = {{
    {hd::kInvalidEnum, "HD_INVALID_ENUM", kDeviceFault, kReport},
    {hd::kInvalidValue, "HD_INVALID_VALUE", kDeviceFault, kReport},
    {hd::kInvalidOperation, "HD_INVALID_OPERATION", kDeviceFault, kReport},
    {hd::kInvalidInputType, "HD_INVALID_INPUT_TYPE", kDeviceFault, kReport},
    {hd::kBadHandle, "HD_BAD_HANDLE", kDeviceFault, "engage the device again"},
    {hd::kWarmMotors, "HD_WARM_MOTORS", kDeviceWarm, "let the motors cool down without force"},
    {hd::kExceededMaxForce, "HD_EXCEEDED_MAX_FORCE", kDeviceOverForce, "lower max_force_n or the target"},
    {hd::kExceededMaxForceImpulse, "HD_EXCEEDED_MAX_FORCE_IMPULSE", kDeviceOverForce,
     "lower the rate at which the force may change"},
    {hd::kExceededMaxVelocity, "HD_EXCEEDED_MAX_VELOCITY", kDeviceOverSpeed, "move more slowly"},
    {hd::kForceError, "HD_FORCE_ERROR", kDeviceFault, "let the device rest, then engage it again"},
    {hd::kDeviceFault, "HD_DEVICE_FAULT", kDeviceFault, kPlug},
    {hd::kDeviceAlreadyInitiated, "HD_DEVICE_ALREADY_INITIATED", kDeviceFault,
     "close the other program that uses the device"},
    {hd::kCommError, "HD_COMM_ERROR", kDeviceFault, kPlug},
    {hd::kCommConfigError, "HD_COMM_CONFIG_ERROR", kDeviceFault,
     "set the device up with the vendor's tool and use the name given there"},
    {hd::kTimerError, "HD_TIMER_ERROR", kDeviceFault, "check that the service may use real-time priorities"},
    {hd::kIllegalBegin, "HD_ILLEGAL_BEGIN", kDeviceFault, kReport},
    {hd::kIllegalEnd, "HD_ILLEGAL_END", kDeviceFault, kReport},
    {hd::kFrameError, "HD_FRAME_ERROR", kDeviceFault, kReport},
    {hd::kInvalidPriority, "HD_INVALID_PRIORITY", kDeviceFault, kReport},
    {hd::kSchedulerFull, "HD_SCHEDULER_FULL", kDeviceFault,
     "close other programs that use the vendor's scheduler"},
    {hd::kInvalidLicense, "HD_INVALID_LICENSE", kDeviceFault, "renew the vendor's licence"},
    {0xFFFFFFFF, "unknown HD error", kDeviceFault, kReport},
}};

}  // namespace

const std::array<HdError, kHdErrorCount>& hd_errors() noexcept {
  return kErrors;
}

std::size_t hd_error_index(hd::ErrorCode code) noexcept {
  for (std::size_t index = 0; index + 1 < kErrors.size(); ++index) {
    if (kErrors[index].code == code) return index;
  }
  return kErrors.size() - 1;
}

}  // namespace hapticd::openhaptics
