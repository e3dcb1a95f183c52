#include "rt/guard/guard.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "hal/sim/base/random.h"
#include "rt/control/hand_port_passivity.h"
#include "rt/signal/vector.h"
#include "tests/measure/study/extremes/extreme.h"

namespace hapticd::study::extremes {

namespace {

constexpr double kRateHz = 1000.0;
constexpr double kInf = std::numeric_limits<double>::infinity();

rt::GuardLimits limits() {
  rt::GuardLimits limits;
  limits.max_force_n = 8.5;
  limits.max_force_rate_n_per_s = 2000.0;
  return limits;
}

hal::RigSample sample_at(long tick) {
  hal::RigSample sample;
  sample.tick = static_cast<std::uint64_t>(tick);
  sample.time_ns = tick * 1'000'000;
  sample.force_count = 10;
  return sample;
}

struct Excess {
  Largest force_n, change_n, fault_force_n;
};

/// Any command, any sample, cleared at random: what passes beyond the limits.
Excess anything(const Effort& effort) {
  rt::Guard guard(limits(), kRateHz);
  sim::Random random(1);
  Excess excess;
  hal::Vector3 before;
  const auto any = [&] {
    const double u = random.uniform();
    if (u < 0.003) return std::nan("");
    if (u < 0.006) return kInf;
    if (u < 0.009) return -1e300;
    return (random.uniform() < 0.5 ? -1.0 : 1.0) * std::pow(10.0, 6.0 * random.uniform() - 4.0);
  };
  const long ticks = effort.ticks(1.0);
  for (long i = 0; i < ticks; ++i) {
    hal::RigSample sample = sample_at(i);
    sample.tip_position_mm = {0.0, 0.0, random.uniform() < 0.001 ? any() : 0.0};
    if (random.uniform() < 0.001) sample.status = 1U << static_cast<unsigned>(11.0 * random.uniform());
    const hal::Vector3 force = guard.release(guard.admit(sample), {any(), any(), any()}, 0);
    excess.force_n.see(std::max(0.0, rt::norm(force) - limits().max_force_n));
    const double most = 1e-3 * limits().max_force_rate_n_per_s;
    // A bound comes before the rate: what the bound on power takes from a force it takes at once.
    const bool cut = rt::norm(force) == 0.0;
    const bool weakened =
        (guard.limited() & rt::guard_limit::kPower) != 0 && rt::norm(force) < rt::norm(before);
    if (!cut && !weakened) excess.change_n.see(std::max(0.0, rt::norm(force - before) - most));
    if (guard.force_is_zero()) excess.fault_force_n.see(rt::norm(force));
    before = force;
    if (random.uniform() < 0.05) guard.clear();
  }
  return excess;
}

double cut_at_nan(const Effort&) {
  rt::Guard guard(limits(), kRateHz);
  for (long i = 0; i < 100; ++i) {
    guard.release(guard.admit(sample_at(i)), {0.0, 0.0, 5.0}, 0);
  }
  hal::RigSample bad = sample_at(100);
  bad.sensor_force_n.x = std::nan("");
  for (long ticks = 0; ticks < 100; ++ticks) {
    if (rt::norm(guard.release(guard.admit(bad), {0.0, 0.0, 5.0}, 0)) == 0.0)
      return static_cast<double>(ticks);
  }
  return 100.0;
}

/// Ticks from the clear to the full force.
double resumed(const Effort&) {
  rt::Guard guard(limits(), kRateHz);
  guard.raise(rt::GuardFault::kStopped);
  guard.release(guard.admit(sample_at(0)), {0.0, 0.0, 5.0}, 0);
  guard.clear();
  for (long i = 1; i < 10'000; ++i) {
    if (guard.release(guard.admit(sample_at(i)), {0.0, 0.0, 5.0}, 0).z == 5.0) return static_cast<double>(i);
  }
  return 1e4;
}

double power_bounded(const Effort&) {
  rt::Guard guard(limits(), kRateHz);
  Largest largest;
  for (long i = 0; i < 5000; ++i) {
    hal::RigSample sample = sample_at(i);
    sample.tip_position_mm.z = std::min(9000.0, 2.0 * static_cast<double>(i));  // 2 m/s
    const hal::Vector3 force = guard.release(guard.admit(sample), {0.0, 0.0, 8.0}, 0);
    if (i > 200 && i < 4400) largest.see(1e-3 * force.z * 2000.0);
  }
  return largest.value();
}

double port_ten_hours(const Effort& effort) {
  rt::HandPortPassivity port(kRateHz);
  port.begin();
  const long ticks = effort.ticks(10.0);
  for (long i = 0; i < ticks; ++i) {
    // A spring of 1 N/mm between two counts, its force the mean over the way.
    const double step = i % 2 == 0 ? -0.03 : 0.03;
    port.update({0.0, 0.0, 1.0}, {}, {0.0, 0.0, step}, {0.0, 0.0, kRateHz * step});
  }
  return std::abs(port.energy_mj());
}

/// A port that only gives energy: α bounded, its force never drives.
double port_of_a_source(const Effort& effort) {
  rt::HandPortPassivity port(kRateHz);
  port.begin();
  sim::Random random(2);
  Largest damping;
  const long ticks = effort.ticks(1.0);
  for (long i = 0; i < ticks; ++i) {
    const double speed = std::pow(10.0, 9.0 * random.uniform() - 6.0);
    const hal::Vector3 velocity{0.0, 0.0, random.uniform() < 0.5 ? -speed : speed};
    const hal::Vector3 step = velocity * 1e-3;
    const hal::Vector3 drive{0.0, 0.0, velocity.z > 0.0 ? 5.0 : -5.0};
    const hal::Vector3 force = port.update(drive, {}, step, velocity);
    damping.see(port.damping_n_s_per_mm());
    if (dot(force, velocity) > 0.0) return kInf;
  }
  return damping.value();
}

double port_at_rest(const Effort& effort) {
  rt::HandPortPassivity port(kRateHz);
  port.begin();
  port.update({0.0, 0.0, 100.0}, {}, {0.0, 0.0, 1.0}, {0.0, 0.0, 1000.0});  // deep in debt
  return largest_of(effort.ticks(0.1), [&](long) {
    return rt::norm(port.update({0.0, 0.0, 100.0}, {}, {}, {}));
  });
}

}  // namespace

ExtremeGroup guard_extremes() {
  const double rounding = 1e-12;
  return {
      "guard",
      "Guard and passivity at the hand's port",
      {
          {"guard", "an hour of any command and sample: NaN, ∞, 1e300, faults, clears",
           "force beyond the limit", "N", rounding, "max_force_n",
           [](const Effort& e) { return anything(e).force_n.value(); }},
          {"guard", "the same, change in a tick", "change beyond the limit", "N", rounding,
           "max_force_rate; cut, power exempt", [](const Effort& e) { return anything(e).change_n.value(); }},
          {"guard", "the same, while a fault holds force back", "largest force", "N", 0.0, "silent is zero",
           [](const Effort& e) { return anything(e).fault_force_n.value(); }},
          {"guard", "NaN in a sample at 5 N", "ticks to zero force", "ticks", 0.0, "cut in that tick",
           cut_at_nan},
          {"guard", "cleared at 5 N wanted", "ticks to full force", "ticks", 501.0, "resume_ramp 0.5 s",
           resumed},
          {"guard", "8 N along 2 m/s", "power", "W", 2.0 * (1.0 + 1e-9), "max_power_w", power_bounded},
          {"passivity", "ten hours of a spring between two counts", "drift of the energy", "mJ",
           36e6 * 0.03 * 2.3e-16, "ε a tick", port_ten_hours},
          {"passivity", "a source of energy, 1e-6 … 1e3 mm/s, an hour", "largest damping", "N·s/mm",
           rt::HandPortPassivity::kMaxDampingNsPerMm, "bounded, never drives", port_of_a_source},
          {"passivity", "v = 0 for minutes, 100 mJ in debt", "force added", "N", 0.0, "no motion, no force",
           port_at_rest},
      }};
}

}  // namespace hapticd::study::extremes
