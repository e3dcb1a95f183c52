// Trap of (6.3): the tumour's displacement, explicit next to the exact solution of (6.2).

#include <cmath>
#include <numbers>

#include "tests/measure/study/extremes/traps/trap.h"

namespace hapticd::study::extremes {

namespace {

constexpr double kStiffness = 0.45;  // N/mm, D§6.3
constexpr double kDamping = 0.004;   // N·s/mm
constexpr double kPeriodS = 1e-3;

/// (6.3) with ḋ_t(t) = ḋ_t(t - 1), as D§6.3 has it.
class ExplicitTumour {
 public:
  explicit ExplicitTumour(double ratio) : ratio_(ratio) {}
  double step(double d_mm, double rate_mm_per_s) {
    const double lag_s = ratio_ * kPeriodS;  // B/K
    const double next = 0.5 * d_mm + 0.5 * lag_s * rate_mm_per_s - lag_s * rate_;
    rate_ = (next - at_) / kPeriodS;
    return at_ = next;
  }

 private:
  double ratio_;
  double at_ = 0.0;
  double rate_ = 0.0;
};

/// (6.2) solved: with e = d_t - d/2 it reads K e + B ė = 0, so e⁺ = e exp(-K T/B), whatever d does.
class ExactTumour {
 public:
  explicit ExactTumour(double ratio) : decay_(std::exp(-1.0 / ratio)) {}
  double step(double d_mm) {
    rest_ *= decay_;
    return 0.5 * d_mm + rest_;
  }

 private:
  double decay_;
  double rest_ = 0.0;
};

/// A press of 10 mm in 0.1 s.
double pressed_mm(double t_s) {
  return t_s < 0.1 ? 5.0 * (1.0 - std::cos(std::numbers::pi * 10.0 * t_s)) : 10.0;
}

}  // namespace

Trap tumour_trap() {
  const double ratio = kDamping / (kStiffness * kPeriodS);
  Trap trap;
  trap.name = "7 (6.3), the tumour";
  trap.fails = "diverges from B/(K T) = 1/2 on; the published constants give 8.9 (hapticd has no tumour yet)";
  trap.predicts = "z² + r z - r = 0, r = B/(K T): a pole at -1 for r = 1/2; (6.2) solves to d/2 + e^(-Kt/B)";
  trap.quantity = "pole |z| from the last ten steps of 12 ms";
  trap.unit = "1";
  trap.limit = 1.0;
  trap.plot_name = "tumour";
  trap.plot = small_plot("A press of 10 mm in 0.1 s, K 0.45 N/mm, B 0.004 N·s/mm", {"time", "ms"},
                         {"|d_t|", "mm", true, 1e-3, 1e9});
  report::PlotSeries bad = published("(6.3)"), stable{"(6.3), B/(KT) 0.4"}, good = ours("(6.2) solved");
  stable.color = cli::palette(5);
  ExplicitTumour tumour(ratio), slow(0.4);
  ExactTumour exact(ratio);
  double before = 0.0, pole = 0.0;
  for (int i = 1; i <= 60; ++i) {
    const double t = kPeriodS * i;
    const double d = pressed_mm(t);
    const double rate = (d - pressed_mm(t - kPeriodS)) / kPeriodS;
    const double by_published = tumour.step(d, rate);
    if (i <= 12) {
      pole = before != 0.0 ? std::abs(by_published / before) : 0.0;
      bad.add(1e3 * t, std::abs(by_published));
    }
    before = by_published;
    good.add(1e3 * t, exact.step(d));
    stable.add(1e3 * t, std::abs(slow.step(d, rate)));
  }
  trap.plot.series = {bad, stable, good};
  trap.forms = {{"published", pole}, {"(6.2) solved, for when it is built", std::exp(-1.0 / ratio)}};
  return trap;
}

}  // namespace hapticd::study::extremes
