#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string_view>
#include <vector>

#include "tests/measure/study/common/oscillation.h"

namespace hapticd::study {

/// What becomes of a contact that was knocked and then left alone, in the order of how much more there is to
/// fear.
enum class StabilityClass : std::uint8_t {
  kStable,        ///< at rest, or what is left of the knock dies away
  kSlowMode,      ///< stable too, but still creeping or relaxing
  kLimitCycle,    ///< swings on and on
  kDiverging,     ///< swings more and more
  kUndetected,    ///< rests on the object, but the detector takes it for free: nothing is rendered
  kContactLost,   ///< bounces off the object, again and again or for good
  kGuardLatched,  ///< the guard had to take the force away
};
inline constexpr std::size_t kStabilityClasses = 7;

constexpr bool is_stable(StabilityClass c) noexcept {
  return c == StabilityClass::kStable || c == StabilityClass::kSlowMode;
}
std::string_view to_text(StabilityClass c) noexcept;

/// Classifies from the truth, a tick at a time, over the time after a knock. In words:
///   guard latched  at any time;
///   contact lost   the tip was off the object in more than 2 % of the last second;
///   undetected     it was on the object, but the detector missed it in more than 2 % of the last second;
///   limit cycle    the tip's position or the object's force swings, in windows of a quarter second and about
///                  their straight line, by more than 0.1 mm or 1 N in the last window, and by no less than
///                  half of what it did a second before;
///   diverging      the same, and more than twice as much as a second before;
///   slow mode      none of these, but the tip moved on by more than 0.1 mm over the last second;
///   stable         otherwise.
/// The force counts because a stiff object pins the tip: what swings there is structure and motor, and the
/// object gets the blows. Encoder steps in the force are smaller than 1 N.
class StabilityJudge {
 public:
  static constexpr double kVisibleN = 1.0;
  static constexpr double kLostShare = 0.02;

  struct Tick {
    double position_mm = 0.0;
    double reaction_n = 0.0;
    bool touching = true;  ///< in truth
    bool detected = true;  ///< by the renderer
    bool latched = false;
  };

  explicit StabilityJudge(double rate_hz);
  void add(const Tick& tick);
  StabilityClass verdict() const;
  /// Swing of the last quarter second.
  double swing_mm() const { return position_.peak_to_peak(); }
  double swing_n() const { return force_.peak_to_peak(); }

 private:
  struct Window {
    double mean_mm = 0.0;
    std::size_t off = 0;
    std::size_t missed = 0;
  };
  static constexpr std::size_t kWindowsPerSecond = 4;

  std::size_t window_ticks_;
  OscillationJudge position_;
  OscillationJudge force_;
  bool latched_ = false;
  std::size_t ticks_ = 0;
  Window now_;
  std::vector<Window> windows_;
};

}  // namespace hapticd::study
