// Traps of (4.22) and (4.23): noise at small force; a static law does not give the sponge's figures.

#include <cmath>

#include "hal/sim/base/random.h"
#include "hal/sim/object/material.h"
#include "hal/sim/object/object_model.h"
#include "rt/deformation/fused_displacement.h"
#include "rt/deformation/hunt_crossley.h"
#include "tests/measure/study/extremes/traps/trap.h"

namespace hapticd::study::extremes {

namespace {

constexpr rt::HuntCrossleyParameters kSponge{0.0059, 0.0, 2.1};  // N/mm^m: 0.18 N/mm at 4 N (D§4.7)
constexpr double kTarget = 0.8;                                  // N/mm
constexpr double kJitterN = 0.01;                                // D§3.2.2

struct Gains {
  double inverse = 0.0, fused = 0.0, closed_form = 0.0;
};

/// Newtons of k~ x per newton of jitter at this force, the tip sliding at 100 mm/s.
Gains noise_gains(double force_n) {
  sim::Random random(1);
  const double x = rt::hunt_crossley_displacement(kSponge, force_n, 0.0).displacement_mm;
  rt::FusedDisplacement fused(0.05, kJitterN, 1000.0);
  fused.begin(x, 0.1);
  double n = 0.0, inverse = 0.0, inverse2 = 0.0, mixed = 0.0, mixed2 = 0.0;
  for (int i = 0; i < 6000; ++i) {
    // Small enough not to be clipped at zero, so that what is measured is the gain.
    const double jitter = 0.1 * kJitterN * random.normal();
    const rt::LawEstimate law = rt::hunt_crossley_displacement(kSponge, force_n + jitter, 0.0);
    fused.update(0.0, 0.1, law);
    if (i < 1000) continue;
    n += 1.0;
    inverse += law.displacement_mm;
    inverse2 += law.displacement_mm * law.displacement_mm;
    mixed += fused.displacement_mm();
    mixed2 += fused.displacement_mm() * fused.displacement_mm();
  }
  const auto deviation = [n](double sum, double squares) {
    return std::sqrt(std::max(0.0, squares / n - (sum / n) * (sum / n)));
  };
  const double per_n = kTarget / (0.1 * kJitterN);
  return {per_n * deviation(inverse, inverse2), per_n * deviation(mixed, mixed2),
          kTarget * x / (kSponge.exponent * force_n)};
}

}  // namespace

Trap inverse_noise_trap() {
  Trap trap;
  trap.name = "8 noise gain of (4.23)";
  trap.fails =
      "10 mN of jitter become 0.18 N of target force at 60 mN: the instability of D§4.6.2 at small forces";
  trap.predicts = "∂(k~ x)/∂f = k~ x/(m f)";
  trap.quantity = "noise of k~ x over noise of f at 60 mN, k~ 0.8 N/mm";
  trap.unit = "1";
  trap.limit = 1.0;
  trap.plot_name = "inverse_noise";
  trap.plot = small_plot("Sponge (K 0.0059, m 2.1), target 0.8 N/mm", {"reaction force", "N", true},
                         {"noise gain", "1", true});
  report::PlotSeries bad = published("(4.23)"), good = ours("fused"), form{"k~ x/(m f)"};
  form.color = cli::palette(2);
  form.marks_only();
  for (double force = 0.02; force < 4.1; force *= 1.3) {
    const Gains gains = noise_gains(force);
    for (auto [series, value] :
         {std::pair{&bad, gains.inverse}, {&good, gains.fused}, {&form, gains.closed_form}}) {
      series->add(force, value);
    }
  }
  const Gains light = noise_gains(0.06);
  trap.plot.series = {bad, good, form};
  trap.plot.references = {{report::PlotReference::Axis::kY, 1.0, "1"}};
  trap.forms = {{"published, (4.23)", light.inverse}, {"here, fused", light.fused}};
  return trap;
}

Trap static_sponge_trap() {
  Trap trap;
  trap.name = "9 a static law does not give the sponge's figures";
  trap.fails =
      "0.18 N/mm at 4 N with m = 2.1 is 8.2 mm deep at 0.5 N (reported: 5 mm) and lets 15 mN be felt 16 ms "
      "late "
      "at "
      "100 mm/s (reported: below 3 ms)";
  trap.predicts = "x = (f/K)^(1/m)";
  trap.quantity = "time from touch to 15 mN at 100 mm/s";
  trap.unit = "ms";
  trap.limit = 3.0;
  trap.plot_name = "static_sponge";
  trap.plot = small_plot("Sponge pressed at 100 mm/s", {"displacement", "mm"}, {"force", "N"});
  constexpr double kSpeed = 100.0, kStepS = 1e-4;
  report::PlotSeries law = published("static (4.22)"), object = ours("simulated sponge"),
                     reported{"reported (D§4.6.2)"};
  reported.color = cli::palette(2);
  reported.marks_only();
  reported.mark_size = 1.0;
  reported.add(5.0, 0.5);
  sim::Material material(sim::object_preset("sponge_cut")->material, kStepS);
  double late_ms = 0.0;
  for (int i = 1; i <= 1200; ++i) {
    const double x = kSpeed * kStepS * i;
    const double force = material.advance(x, 0.0).force_n;
    if (late_ms == 0.0 && force > 0.015) late_ms = 1e3 * kStepS * i;
    if (i % 10 != 0) continue;
    law.add(x, rt::hunt_crossley_force_n(kSponge, x, 0.0));
    object.add(x, force);
  }
  trap.plot.series = {law, object, reported};
  trap.forms = {
      {"static (4.22)", 1e3 * rt::hunt_crossley_displacement(kSponge, 0.015, 0.0).displacement_mm / kSpeed},
      {"simulated sponge", late_ms}};
  return trap;
}

}  // namespace hapticd::study::extremes
