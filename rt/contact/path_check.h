#pragma once

#include <algorithm>
#include <cmath>

namespace hapticd::rt {

/// Whether the reaction goes with the path, as that of an object does: where the tip goes deeper, a contact
/// law must see so too. A reading that stays the same while the tip goes on is a wrong zero.
///
/// A cumulative sum for each sense, inward and outward, over stretches of kStretchMm:
///
///   E <- max(0, E + Δp - 3 max(0, Δq) - 0.35 Δs)      contradicted: E > 1 mm + what the caller is unsure of
///
/// Δp is the path along the normal, Δq the change of the depth that the law makes of the reaction, both
/// counted in that sense, Δs the path across the normal (a normal that is wrong by 20° takes 0.35 Δs for
/// depth). So an object may be three times as soft as its law, and as hard as it likes.
class PathCheck {
 public:
  /// `inward_mm` and `slide_mm`: of this tick, along and across the normal; `law_change_mm`: of the depth by
  /// the law, since the last tick.
  void update(double inward_mm, double slide_mm, double law_change_mm) noexcept {
    inward_mm_ += inward_mm;
    slide_mm_ += slide_mm;
    law_mm_ += law_change_mm;
    if (std::abs(inward_mm_) < kStretchMm) return;
    add(excess_inward_mm_, inward_mm_, law_mm_);
    add(excess_outward_mm_, -inward_mm_, -law_mm_);
    inward_mm_ = slide_mm_ = law_mm_ = 0.0;
  }
  bool is_contradicted(double uncertain_mm) const noexcept {
    return std::max(excess_inward_mm_, excess_outward_mm_) > kAllowedMm + uncertain_mm;
  }
  void begin() noexcept { *this = {}; }

 private:
  static constexpr double kStretchMm = 0.2;  // of noise, a stretch has little
  static constexpr double kSoftnessRatio = 3.0;
  static constexpr double kSlideShare = 0.35;
  static constexpr double kAllowedMm = 1.0;

  void add(double& excess_mm, double path_mm, double law_mm) const noexcept {
    excess_mm =
        std::max(0.0, excess_mm + path_mm - kSoftnessRatio * std::max(0.0, law_mm) - kSlideShare * slide_mm_);
  }

  double inward_mm_ = 0.0;  ///< of the present stretch
  double slide_mm_ = 0.0;
  double law_mm_ = 0.0;
  double excess_inward_mm_ = 0.0;
  double excess_outward_mm_ = 0.0;
};

}  // namespace hapticd::rt
