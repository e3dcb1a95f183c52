#pragma once

#include <memory>
#include <mutex>
#include <utility>

#include "server/calibration/model/arm_calibration.h"

namespace hapticd::calibration {

/// The calibration in use, or none. Any thread but the tick's.
class AdoptedCalibration {
 public:
  std::shared_ptr<const ArmCalibration> get() const {
    const std::lock_guard lock(mutex_);
    return calibration_;
  }
  void set(std::shared_ptr<const ArmCalibration> calibration) {
    const std::lock_guard lock(mutex_);
    calibration_ = std::move(calibration);
  }

 private:
  mutable std::mutex mutex_;
  std::shared_ptr<const ArmCalibration> calibration_;
};

}  // namespace hapticd::calibration
