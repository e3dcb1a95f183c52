#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "hal/lock/mutex.h"
#include "server/calibration/model/adopted_calibration.h"
#include "server/calibration/store/stored_calibration.h"
#include "server/session/outcome.h"

namespace hapticd::server {

/// Calibrations that were made, one file each, HASH.json; and which of them is adopted, in the file
/// `adopted`. A file that does not have its hash is left alone and not shown. Any thread.
class CalibrationStore {
 public:
  /// `folder` is made with the first calibration; empty = in memory. `rig`: a calibration of another rig is
  /// not adopted when the daemon starts.
  CalibrationStore(std::string folder, std::string rig);

  /// Gives it its hash, and keeps it.
  Outcome<StoredCalibration> keep(StoredCalibration calibration);
  /// Lists them, newest first.
  std::vector<StoredCalibration> list() const;
  /// Finds a calibration by its hash, or at least six of its first digits.
  Outcome<StoredCalibration> find(const std::string& hash) const;
  /// Adopts a calibration; empty: none any more. Refused: a tip calibration, which corrects nothing by
  /// itself; one of another rig.
  Outcome<std::string> adopt(const std::string& hash);
  std::optional<Refusal> remove(const std::string& hash);
  /// Hash of the one in use; empty = none.
  std::string adopted_hash() const;
  /// Calibration for the code that corrects poses.
  const calibration::AdoptedCalibration& adopted() const { return adopted_; }

 private:
  Outcome<StoredCalibration> find_locked(const std::string& hash) const REQUIRES(mutex_);
  std::optional<Refusal> write(const std::string& name, const std::string& text) const;

  const std::string folder_;
  const std::string rig_;
  mutable SerialMutex mutex_;                              ///< held while a file of some kilobytes is written
  std::vector<StoredCalibration> all_ GUARDED_BY(mutex_);  ///< oldest first
  std::string adopted_hash_ GUARDED_BY(mutex_);
  calibration::AdoptedCalibration adopted_;
};

}  // namespace hapticd::server
