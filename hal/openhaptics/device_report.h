#pragma once

#include <memory>
#include <optional>
#include <string>

#include "hal/openhaptics/device_session.h"
#include "hal/part_report.h"

namespace hapticd::openhaptics {

/// The input of a report; read outside the callback.
struct DeviceView {
  bool engaged = false;
  bool running = false;
  bool stalled = false;
  bool lost = false;     ///< abandoned; has to be engaged again
  std::string refusal;   ///< why it was not engaged or the run did not start; empty if all went well
  double rate_hz = 0.0;  ///< measured; 0 = not known yet
  DeviceFacts facts;
  std::shared_ptr<ServoReport> servo;  ///< of the last engagement
  std::shared_ptr<DeviceErrorSlot> slot;
};

hal::PartReport report_on(const OpenHapticsConfig& config, const DeviceView& view);

}  // namespace hapticd::openhaptics
