#include <cmath>
#include <limits>

#include "hal/sim/base/random.h"
#include "rt/control/back_drive_compensation.h"
#include "rt/friction/dahl.h"
#include "rt/friction/maxwell_slip.h"
#include "tests/measure/study/extremes/extreme.h"

namespace hapticd::study::extremes {

namespace {

constexpr double kCountMm = 0.03;

/// One long step against a thousand short ones, from full friction the other way.
double dahl_split(const Effort&) {
  Largest largest;
  for (const double exponent : {0.0, 0.5, 1.0, 1.5, 2.0, 3.0}) {
    for (const double presliding_mm : {1e-4, 1e-2, 1.0, 1e3}) {
      for (const double share : {0.01, 0.3, 1.0, 10.0}) {
        const double path_mm = share * presliding_mm;
        double z = -1.0;
        for (int i = 0; i < 1000; ++i) z = rt::dahl_step(z, 1e-3 * path_mm, presliding_mm, exponent);
        largest.see(z - rt::dahl_step(-1.0, path_mm, presliding_mm, exponent));
      }
    }
  }
  return largest.value();
}

double dahl_any_steps(const Effort& effort) {
  sim::Random random(1);
  double z = 0.0;
  return largest_of(effort.ticks(1.0), [&](long) {
    const double step = std::pow(10.0, 15.0 * random.uniform() - 9.0);
    z = rt::dahl_step(z, random.uniform() < 0.5 ? step : -step, 0.3);
    return z;
  });
}

double dahl_rest(const Effort& effort) {
  double z = 0.123;
  hal::Vector3 plane{0.1, -0.2, 0.0};
  const long ticks = effort.ticks(10.0);
  for (long i = 0; i < ticks; ++i) {
    z = rt::dahl_step(z, 0.0, 0.3);
    plane = rt::dahl_step(plane, hal::Vector3{}, 0.3);
  }
  return std::abs(z - 0.123) + rt::norm(plane - hal::Vector3{0.1, -0.2, 0.0});
}

double dahl_no_load(const Effort&) {
  Largest largest;
  for (const double presliding_mm : {0.0, 1e-300, 1e-30, 1e-9}) {
    for (const double exponent : {0.0, 1.0, 3.0}) {
      // 3: at exponents above 1 full friction is approached by a power law only, δ/l to the ½.
      const double left =
          exponent > 1.0 ? std::pow(2.0 * kCountMm / std::max(presliding_mm, 1e-300), -0.5) : 0.0;
      largest.see(
          std::max(0.0, std::abs(rt::dahl_step(0.7, -kCountMm, presliding_mm, exponent) + 1.0) - left));
    }
  }
  return largest.value();
}

double dahl_dither(const Effort& effort) {
  double z = 0.0;
  const long ticks = effort.ticks(10.0);
  for (long i = 0; i < ticks; ++i) z = rt::dahl_step(z, i % 2 == 0 ? kCountMm : -kCountMm, 0.3);
  return std::abs(std::abs(z) - std::tanh(0.5 * kCountMm / 0.3));
}

double dahl_nan(const Effort&) {
  const hal::Vector3 z{0.3, 0.4, 0.0};
  const double nan = std::numeric_limits<double>::quiet_NaN();
  return rt::norm(rt::dahl_step(z, hal::Vector3{nan, 0.0, 0.0}, 0.3) - z);
}

/// A bristle swept round a right angle again and again.
double dahl_ridge(const Effort&) {
  hal::Vector3 z;
  Largest largest;
  for (int i = 0; i < 1'000'000; ++i) {
    const bool along = (i / 7) % 2 == 0;
    z = rt::dahl_step(z, along ? hal::Vector3{0.05, 0.0, 0.0} : hal::Vector3{0.0, 0.05, 0.0}, 0.3);
    largest.see(rt::norm(z));
  }
  return largest.value();
}

rt::MaxwellSlipParameters maxwell_parameters() {
  rt::MaxwellSlipParameters p;
  p.reach_mm = {1e-4, 1e-3, 1e-2, 0.1, 0.3, 1.0, 10.0, 0.0};
  p.stiffness_per_mm = {100.0, 10.0, 1.0, 0.5, 0.3, 0.1, 0.01, 1e3};
  return p;
}

double maxwell_split(const Effort&) {
  Largest largest;
  for (const double path_mm : {1e-5, 1e-2, 1.0, 100.0}) {
    rt::MaxwellSlip one(maxwell_parameters()), many(maxwell_parameters());
    one.step(-2.0);
    many.step(-2.0);
    double coefficient = 0.0;
    for (int i = 0; i < 1000; ++i) coefficient = many.step(1e-3 * path_mm);
    largest.see(coefficient - one.step(path_mm));
  }
  return largest.value();
}

double maxwell_any_steps(const Effort& effort) {
  rt::MaxwellSlip slip(maxwell_parameters());
  sim::Random random(2);
  return largest_of(effort.ticks(1.0),
                    [&](long) {
                      const double step = std::pow(10.0, 12.0 * random.uniform() - 9.0);
                      return slip.step(random.uniform() < 0.5 ? step : -step);
                    }) /
         maxwell_parameters().kinetic();
}

double maxwell_dither(const Effort& effort) {
  // A closed inner loop stays closed: the friction at the start of each cycle is that of the first.
  rt::MaxwellSlip slip(maxwell_parameters());
  slip.step(-2.0);
  slip.step(kCountMm);
  const double first = slip.step(-kCountMm);
  double last = 0.0;
  const long ticks = effort.ticks(10.0) / 2;
  for (long i = 0; i < ticks; ++i) {
    slip.step(kCountMm);
    last = slip.step(-kCountMm);
  }
  return std::abs(last - first);
}

double back_drive(const Effort& effort) {
  rt::BackDriveCompensation3 compensation(0.2);
  sim::Random random(3);
  Largest largest;
  const long ticks = effort.ticks(10.0) / 4;
  for (long i = 0; i < ticks; ++i) {
    const hal::Vector3 step{kCountMm * std::floor(3.0 * random.uniform() - 1.0), 0.0,
                            kCountMm * std::floor(3.0 * random.uniform() - 1.0)};
    largest.see(rt::norm(compensation.update(step)));
  }
  return largest.value();
}

}  // namespace

ExtremeGroup friction_extremes() {
  return {"friction",
          "Friction: Dahl, Maxwell-slip, the device's own",
          {
              {"Dahl", "exponent 0 … 3, presliding 1e-4 … 1e3 mm", "one step against a thousand", "1", 1e-12,
               "exact step: a thousand roundings", dahl_split},
              {"Dahl", "random steps of 1e-9 … 1e6 mm, an hour", "largest |z|", "1", 1.0,
               "a convex combination", dahl_any_steps},
              {"Dahl", "v = 0 for ten hours", "drift of z", "1", 0.0, "no motion, no change", dahl_rest},
              {"Dahl", "f_n → 0: presliding 1e-9 … 0 mm, exponent 0 … 3", "z beyond the closed form", "1",
               1e-15, "Coulomb friction", dahl_no_load},
              {"Dahl", "ten hours of dither between two counts", "error of z", "1", 1e-14,
               "tanh(Δ/2δ), rounding", dahl_dither},
              {"Dahl", "a step of NaN, in the plane", "change of z", "1", 0.0, "left out", dahl_nan},
              {"Dahl", "path with 90° turns, in the plane", "largest |z|", "1", 1.0, "a convex combination",
               dahl_ridge},
              {"Maxwell-slip", "steps of 1e-5 … 100 mm", "one step against a thousand", "1", 1e-12,
               "exact step: a thousand roundings", maxwell_split},
              {"Maxwell-slip", "random steps of 1e-9 … 1e3 mm, an hour", "largest share of μ_k", "1",
               1.0 + 1e-15, "every element is held to its reach", maxwell_any_steps},
              {"Maxwell-slip", "ten hours of dither between two counts", "drift of the inner loop", "1",
               18e6 * 8 * 2.3e-16, "8 elements, ε a cycle", maxwell_dither},
              {"back-drive compensation", "dither between counts, 2.5 h", "largest force", "N",
               rt::BackDriveCompensation3::kShare * 0.2 * (1.0 + 1e-15),
               "0.8 of the friction: stays dissipative", back_drive},
          }};
}

}  // namespace hapticd::study::extremes
