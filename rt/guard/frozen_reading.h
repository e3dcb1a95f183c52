#pragma once

#include <algorithm>

#include "hal/samples.h"
#include "rt/signal/vector.h"

namespace hapticd::rt {

/// Whether a force sensor repeats an old value in samples that are new. No two means of a reading that
/// trembles are equal to a millionth of a newton; one that is filtered so far that it does not is never taken
/// for frozen. A tool at rest says nothing either: the tip must have moved meanwhile, by a little under a
/// load, by more in free air.
class FrozenReading {
 public:
  /// Takes one sample, `interval_s` after the one before. `loaded`: the sensor bore a load of late. Returns
  /// true from the sample in which the reading counts as frozen to the one in which it changes.
  bool update(const hal::RigSample& sample, double interval_s, bool loaded) noexcept {
    const hal::Vector3 change_n = sample.sensor_force_n - force_n_;
    if (exceeds(change_n, kSameN)) [[likely]] {
      if (!trembles_) follow_trembling(change_n);
      force_n_ = sample.sensor_force_n;
      tip_mm_ = sample.tip_position_mm;
      same_s_ = 0.0;
      return is_frozen_ = false;
    }
    // A sample without a new reading says nothing: for how long that may last is the guard's limit.
    if (!trembles_ || (sample.status & hal::sample_status::kForceMissing) != 0) return is_frozen_;
    same_s_ += interval_s;
    const auto lasts = [&](double s, double mm) {
      return same_s_ >= s && exceeds(sample.tip_position_mm - tip_mm_, mm);
    };
    is_frozen_ = is_frozen_ || (loaded && lasts(kLoadedS, kLoadedMm)) || lasts(kFreeS, kFreeMm);
    return is_frozen_;
  }

 private:
  /// Noise turns back at two of three readings, what a hand does at few: counts turns against the rest.
  void follow_trembling(const hal::Vector3& change_n) noexcept {
    turns_ = std::clamp(turns_ + (dot(change_n, change_n_) < 0.0 ? kPerTurn : -1), 0, kTrembles);
    trembles_ = turns_ == kTrembles;
    change_n_ = change_n;
  }

  static constexpr double kSameN = 1e-6;  ///< a mean of equal readings is rounded, too
  static constexpr double kLoadedS = 0.02;
  static constexpr double kLoadedMm = 0.5;
  static constexpr double kFreeS = 1.0;
  static constexpr double kFreeMm = 10.0;
  static constexpr int kPerTurn = 3;
  static constexpr int kTrembles = 100;

  hal::Vector3 force_n_;
  hal::Vector3 change_n_;
  hal::Vector3 tip_mm_;  ///< when it was read first
  double same_s_ = 0.0;
  int turns_ = 0;
  bool trembles_ = false;  ///< it has done so
  bool is_frozen_ = false;
};

}  // namespace hapticd::rt
