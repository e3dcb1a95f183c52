#pragma once

#include <memory>
#include <utility>

#include "hal/lock/mutex.h"
#include "server/calibration/model/arm_calibration.h"

namespace hapticd::calibration {

/// The calibration in use, or none. Any thread but the tick's.
class AdoptedCalibration {
 public:
  std::shared_ptr<const ArmCalibration> get() const {
    const MutexLock lock(mutex_);
    return calibration_;
  }
  void set(std::shared_ptr<const ArmCalibration> calibration) {
    const MutexLock lock(mutex_);
    calibration_ = std::move(calibration);
  }

 private:
  mutable Mutex mutex_;
  std::shared_ptr<const ArmCalibration> calibration_ GUARDED_BY(mutex_);
};

}  // namespace hapticd::calibration
