// Traps of Dahl's equation: (4.14) counts the way twice; explicit steps fail at light touch.

#include <algorithm>
#include <cmath>

#include "rt/friction/dahl.h"
#include "tests/measure/study/extremes/traps/trap.h"

namespace hapticd::study::extremes {

namespace {

/// (4.14) with the reset of x_i^t at every turn: the present friction and the way since the reset together.
class PublishedDahl {
 public:
  explicit PublishedDahl(double presliding_mm, double z) : presliding_mm_(presliding_mm), z_(z) {}
  double step(double slide_mm) {
    const double s = std::copysign(1.0, slide_mm);
    if (s != heading_) path_mm_ = 0.0;
    heading_ = s;
    path_mm_ += std::abs(slide_mm);
    return z_ = s + (z_ - s) * std::exp(-path_mm_ / presliding_mm_);
  }

 private:
  double presliding_mm_;
  double z_;
  double path_mm_ = 0.0;
  double heading_ = 0.0;
};

}  // namespace

Trap dahl_counting_trap() {
  constexpr double kPreslidingMm = 0.3;
  constexpr double kStepMm = 0.03;
  Trap trap;
  trap.name = "6a (4.14) counts the way twice";
  trap.fails = "friction turns over in a fraction of the presliding way, and the more samples, the faster";
  trap.predicts = "z = 1 - 2 exp(-x/δ) after a turn";
  trap.quantity = "largest error of friction, of f_c";
  trap.unit = "1";
  trap.limit = 1e-12;
  trap.plot_name = "dahl_counting";
  trap.plot = small_plot("Friction after a turn, δ 0.3 mm, 30 mm/s", {"way since the turn", "mm"},
                         {"friction over f_c", "1"});
  report::PlotSeries bad = published("(4.14)"), good = ours("exact step"), truth{"closed form"};
  truth.color = cli::palette(2);
  truth.marks_only();
  PublishedDahl twice(kPreslidingMm, -1.0);
  double z = -1.0, worst_published = 0.0, worst_here = 0.0;
  for (int i = 1; i <= 50; ++i) {
    const double x = kStepMm * i;
    const double exact = 1.0 - 2.0 * std::exp(-x / kPreslidingMm);
    const double by_published = twice.step(kStepMm);
    z = rt::dahl_step(z, kStepMm, kPreslidingMm);
    worst_published = std::max(worst_published, std::abs(by_published - exact));
    worst_here = std::max(worst_here, std::abs(z - exact));
    bad.add(x, by_published);
    good.add(x, z);
    if (i % 5 == 0) {
      truth.add(x, exact);
    }
  }
  trap.plot.series = {bad, good, truth};
  trap.forms = {{"published", worst_published}, {"here", worst_here}};
  return trap;
}

Trap dahl_euler_trap() {
  Trap trap;
  trap.name = "6b (4.12) in explicit steps at light touch";
  trap.fails = "diverges where σ|Δx|/f_c > 2, that is at f_c below σ|Δx|/2; at f_c = 0 it divides by zero";
  trap.predicts = "factor 1 - σ|Δx|/f_c a step";
  trap.quantity = "|f/f_c| after 50 steps at σ|Δx|/f_c = 3";
  trap.unit = "1";
  trap.limit = 1.0;
  trap.plot_name = "dahl_euler";
  trap.plot = small_plot("50 steps forwards from full friction backwards", {"σ|Δx|/f_c", "1", true},
                         {"largest |f/f_c|", "1", true, 0.5, 1e6});
  report::PlotSeries bad = published("explicit Euler"), good = ours("exact step");
  const auto euler = [](double ratio) {
    double z = -1.0, largest = 1.0;
    for (int i = 0; i < 50; ++i) {
      z += ratio * (1.0 - z);
      largest = std::max(largest, std::abs(z));
    }
    return largest;
  };
  const auto exact = [](double ratio) {
    double z = -1.0, largest = 1.0;
    for (int i = 0; i < 50; ++i) {
      z = rt::dahl_step(z, ratio, 1.0);
      largest = std::max(largest, std::abs(z));
    }
    return largest;
  };
  for (double ratio = 0.1; ratio < 101.0; ratio *= 1.1) {
    bad.add(ratio, std::min(1e6, euler(ratio)));
    good.add(ratio, exact(ratio));
  }
  trap.plot.series = {bad, good};
  trap.plot.references = {{report::PlotReference::Axis::kX, 2.0, "2"}};
  trap.forms = {{"explicit Euler", euler(3.0)}, {"here", exact(3.0)}};
  return trap;
}

}  // namespace hapticd::study::extremes
