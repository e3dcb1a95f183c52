#pragma once

#include <algorithm>
#include <cmath>

namespace hapticd::test {

/// Judges the property "where nothing is touched the device gives no force": at most 0.3 N, and below 0.05 N
/// within 20 ms. Whether something is touched is the truth's to say, never an estimator's; a contact that
/// truly ended starts the clock.
class FreeAirJudge {
 public:
  static constexpr double kMaxN = 0.3;
  static constexpr double kZeroN = 0.05;
  static constexpr double kWithinS = 0.020;

  /// One tick: the force asked of the device, and whether the object is touched.
  void add(double time_s, bool touching, double force_n) noexcept {
    if (last_s_ >= 0.0 && !touching) free_s_ += time_s - last_s_;
    last_s_ = time_s;
    if (touching) {
      touched_s_ = time_s;
      touched_ = true;
      forced_ = false;
      return;
    }
    constexpr double kRoundingS = 1e-9;  // of the difference of two times
    const bool settled = !touched_ || time_s - touched_s_ > kWithinS + kRoundingS;
    if (settled && force_n > max_n_) {
      max_n_ = force_n;
      max_at_s_ = time_s;
    }
    if (force_n < kZeroN) {
      forced_ = false;
      return;
    }
    if (!forced_) {
      forced_ = true;
      // Force that outlasts a contact counts from the contact's end.
      forced_since_s_ = touched_ && time_s - touched_s_ < kWithinS ? touched_s_ : time_s;
    }
    const double ms = 1e3 * (time_s - forced_since_s_);
    if (ms > longest_ms_) {
      longest_ms_ = ms;
      longest_at_s_ = time_s;
    }
  }

  double free_s() const noexcept { return free_s_; }          ///< in free air, in all
  double max_n() const noexcept { return max_n_; }            ///< later than 20 ms after a contact
  double max_at_s() const noexcept { return max_at_s_; }      ///< when that was
  double longest_ms() const noexcept { return longest_ms_; }  ///< 0.05 N or more, at a stretch
  double longest_at_s() const noexcept { return longest_at_s_; }
  bool holds() const noexcept { return max_n_ <= kMaxN && longest_ms_ <= 1e3 * kWithinS; }

 private:
  double last_s_ = -1.0;
  double free_s_ = 0.0;
  bool touched_ = false;
  double touched_s_ = 0.0;
  bool forced_ = false;
  double forced_since_s_ = 0.0;
  double max_n_ = 0.0;
  double max_at_s_ = 0.0;
  double longest_ms_ = 0.0;
  double longest_at_s_ = 0.0;
};

}  // namespace hapticd::test
