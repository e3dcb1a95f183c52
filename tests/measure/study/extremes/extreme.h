#pragma once

#include <cmath>
#include <functional>
#include <limits>
#include <string>
#include <vector>

namespace hapticd::study::extremes {

/// How long cases run: all of it, or a hundredth of it to see that everything runs.
struct Effort {
  bool quick = false;

  /// Ticks of so many simulated hours at 1 kHz.
  long ticks(double hours) const { return std::lround(3.6e6 * hours * (quick ? 0.01 : 1.0)); }
};

/// One stage at one extreme: what is measured, and the bound it must hold, which follows from a closed form
/// or from what the stage promises and was not found by trying.
struct Extreme {
  std::string stage;     ///< as a reader calls it: "Butterworth filter"
  std::string extreme;   ///< what is done to it
  std::string measured;  ///< what `measure` returns
  std::string unit;
  double bound = 0.0;   ///< holds if the value is no larger
  std::string because;  ///< what the bound follows from
  /// Depends on nothing but the effort; what is not finite has failed. Called from several threads.
  std::function<double(const Effort&)> measure;
};

/// Extremes of one folder of rt/ or hal/.
struct ExtremeGroup {
  std::string name;
  std::string title;
  std::vector<Extreme> extremes;
};

ExtremeGroup signal_extremes();
ExtremeGroup contact_extremes();
ExtremeGroup friction_extremes();
ExtremeGroup deformation_extremes();
ExtremeGroup target_extremes();
ExtremeGroup guard_extremes();
ExtremeGroup identify_extremes();
ExtremeGroup modulation_extremes();
ExtremeGroup time_extremes();
ExtremeGroup scene_extremes();
ExtremeGroup simulator_extremes();
ExtremeGroup unexcited_extremes();

/// The largest magnitude seen; not a number from the first that is not finite.
class Largest {
 public:
  void see(double value) noexcept {
    if (!std::isfinite(value)) {
      value_ = std::numeric_limits<double>::quiet_NaN();
    } else if (std::abs(value) > value_) {
      value_ = std::abs(value);
    }
  }
  double value() const noexcept { return value_; }

 private:
  double value_ = 0.0;
};

/// The largest magnitude of what `each` gives in so many ticks.
template <class Each>
double largest_of(long ticks, Each each) {
  Largest largest;
  for (long i = 0; i < ticks; ++i) largest.see(each(i));
  return largest.value();
}

}  // namespace hapticd::study::extremes
