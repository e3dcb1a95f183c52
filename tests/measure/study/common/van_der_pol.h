#pragma once

namespace hapticd::study {

/// The limit cycle judges of oscillation are tried on: ẍ = w (m (1 - x²) ẋ - w x), which ends at amplitude 2
/// from whatever start, inside or outside; scaled to 0.5 mm about -3 mm. Reports `show` the position once a
/// millisecond.
template <class Report>
void van_der_pol(double start, int ticks, const Report& fill_record) {
  constexpr double kW = 60.0;
  constexpr double kM = 0.5;
  constexpr double kStepS = 1e-5;
  constexpr int kStepsATick = 100;
  double x = start;
  double v = 0.0;
  for (int i = 0; i < ticks * kStepsATick; ++i) {
    v += kStepS * kW * (kM * (1.0 - x * x) * v - kW * x);
    x += kStepS * v;
    if (i % kStepsATick == 0) fill_record(-3.0 + 0.25 * x);
  }
}

}  // namespace hapticd::study
