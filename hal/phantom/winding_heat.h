#pragma once

#include <cmath>

namespace hapticd::phantom {

/// Heat of a motor winding, first order: 0 at rest, 1 in the end at the continuous current, d(heat)/dt =
/// ((i / i_continuous)² - heat) / τ; exact for a current held over the step.
///
/// Heat of a motor's winding. Above kWarm the allowed current falls linearly from the peak to the continuous
/// one at heat 1, so that no command, however long, takes the winding beyond its permanent limit. Beyond
/// kOver (a current that was not commanded) no current is allowed until it has cooled below kWarm.
class WindingHeat {
 public:
  static constexpr double kWarm = 0.8;
  static constexpr double kOver = 1.1;

  void advance(double current_a, double continuous_a, double time_constant_s, double dt_s) noexcept {
    const double ratio = current_a / continuous_a;
    const double end = ratio * ratio;
    heat_ = end + (heat_ - end) * std::exp(-dt_s / time_constant_s);
    if (heat_ > kOver) over_ = true;
    if (heat_ < kWarm) over_ = false;
  }

  double heat() const noexcept { return heat_; }
  bool warm() const noexcept { return heat_ >= kWarm; }
  bool over() const noexcept { return over_; }

  double allowed_a(double peak_a, double continuous_a) const noexcept {
    if (over_) return 0.0;
    if (heat_ <= kWarm) return peak_a;
    if (heat_ >= 1.0) return continuous_a;
    return peak_a + (continuous_a - peak_a) * (heat_ - kWarm) / (1.0 - kWarm);
  }

 private:
  double heat_ = 0.0;
  bool over_ = false;
};

}  // namespace hapticd::phantom
