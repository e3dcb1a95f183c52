#include "tests/measure/study/common/scenes.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>

#include "hal/sim/base/random.h"
#include "rt/signal/vector.h"
#include "tests/measure/study/extremes/extreme.h"
#include "tests/measure/study/extremes/fed_scene.h"

namespace hapticd::study::extremes {

namespace {

constexpr double kObjectNPerMm = 0.4;
constexpr double kDeepMm = 4.0;

/// An object of 0.4 N/mm that yields a fifth of its displacement late.
rt::ObjectModel object_model() {
  rt::ObjectModel model;
  model.name = "made_up";
  model.identified_on = "nothing: made up";
  model.max_displacement_mm = 20.0;
  model.max_force_n = 8.0;
  model.hunt_crossley = rt::IdentifiedLaw<rt::HuntCrossleyParameters>{{kObjectNPerMm, 1e-4, 1.0}, 0.05};
  rt::CreepParameters creep;
  creep.weight = {0.8, 0.1, 0.05, 0.05, 0.0};
  creep.max_force_n = 8.0;
  for (std::size_t j = 0; j < rt::CreepParameters::kKnots; ++j) {
    const double share = static_cast<double>(j) / (rt::CreepParameters::kKnots - 1);
    creep.displacement_mm[j] = creep.max_force_n * share * share / kObjectNPerMm;
  }
  model.creep = rt::IdentifiedLaw<rt::CreepParameters>{creep, 0.05};
  model.rod_friction = rt::FrictionParameters{0.3, 0.3, 0.0};
  return model;
}

/// A scene with an elastic half-space under its tool, seen by a rigid device without noise.
class Bench {
 public:
  explicit Bench(bool explore, double target = 0.7)
      : model_(object_model()), scene_(spec(explore, target), &model_) {}

  hal::RigSample at(double height_mm) {
    hal::RigSample sample;
    sample.tick = ticks_++;
    sample.time_ns = time_ns_ += period_ns;
    sample.tip_position_mm = {0.0, 0.0, height_mm};
    sample.sensor_force_n = {0.0, 0.0, kObjectNPerMm * std::max(0.0, -height_mm)};
    sample.force_count = 10;
    return sample;
  }
  rt::TickRecord tick(const hal::RigSample& sample) { return scene_.tick(sample); }
  rt::TickRecord move(double from_mm, double to_mm, int ticks) {
    rt::TickRecord record;
    for (int i = 1; i <= ticks; ++i) {
      const double share = static_cast<double>(i) / ticks;
      record = tick(at(from_mm + (to_mm - from_mm) * share * share * (3.0 - 2.0 * share)));
    }
    return record;
  }
  rt::TickRecord press_and_hold() {
    move(10.0, 10.0, 300);
    move(10.0, -kDeepMm, 1000);
    return move(-kDeepMm, -kDeepMm, 10'000);
  }
  FedScene& scene() { return scene_; }
  std::int64_t period_ns = 1'000'000;
  std::int64_t time_ns() const { return time_ns_; }

 private:
  static rt::SceneSpec spec(bool explore, double target) {
    rt::SceneSpec scene = explore ? explore_scene(rt::Tip::kRod) : tap_scene();
    if (explore) scene.object_model = "made_up";
    scene.structural_compensation = false;
    scene.compensation.back_drive = false;  // it would add to what (3.3) asks for
    scene.target = rt::linear_target(target);
    return scene;
  }
  rt::ObjectModel model_;
  FedScene scene_;
  std::uint64_t ticks_ = 0;
  std::int64_t time_ns_ = 0;
};

double held_ten_hours(bool explore, const Effort& effort) {
  Bench bench(explore);
  const double first = bench.press_and_hold().displacement_mm;
  return largest_of(effort.ticks(explore ? 5.0 : 10.0), [&](long) {
    const rt::TickRecord record = bench.tick(bench.at(-kDeepMm));
    return record.in_contact ? record.displacement_mm - first : 1e3;
  });
}

double dithered(bool explore, const Effort& effort) {
  Bench bench(explore);
  bench.press_and_hold();
  sim::Random random(1);
  hal::Vector3 off;
  Largest largest;
  const long ticks = effort.ticks(0.1);
  double lost = 0.0;
  for (long i = 0; i < ticks; ++i) {
    for (double* axis : {&off.x, &off.y, &off.z}) {
      if (random.uniform() < 0.1) *axis = 0.03 - *axis;
    }
    hal::RigSample sample = bench.at(-kDeepMm);
    sample.tip_position_mm = sample.tip_position_mm + off;
    sample.sensor_force_n.z += 0.003 * random.normal();
    const rt::TickRecord record = bench.tick(sample);
    largest.see(record.displacement_mm - kDeepMm);
    if (!record.in_contact) ++lost;
  }
  return lost > 0.0 ? 1e3 : largest.value();
}

/// Pressed down in a period that jitters by 30 % and has gaps of 5 ms: displacement error at the end.
double uneven(bool explore, const Effort&) {
  Bench bench(explore);
  sim::Random random(2);
  bench.move(10.0, 10.0, 300);
  const std::int64_t begin_ns = bench.time_ns();
  rt::TickRecord record;
  for (double share = 0.0; share < 1.0;) {
    bench.period_ns = 700'000 + static_cast<std::int64_t>(600'000 * random.uniform());
    if (random.uniform() < 0.03) bench.period_ns += 5'000'000;
    share = std::min(1.0, 1e-9 * static_cast<double>(bench.time_ns() + bench.period_ns - begin_ns));
    record = bench.tick(bench.at(10.0 - 14.0 * share * share * (3.0 - 2.0 * share)));
  }
  bench.period_ns = 1'000'000;
  for (int i = 0; i < 3000; ++i) record = bench.tick(bench.at(-kDeepMm));
  return record.contact_count == 1 ? std::abs(record.displacement_mm - kDeepMm) : 1e3;
}

/// Force commanded while pressed to 4 mm, against k~ x asked beyond the object: f_d = (k - k~) x, the
/// device's limit.
double target_error(bool explore, double target, const Effort&) {
  Bench bench(explore, target);
  const rt::TickRecord record = bench.press_and_hold();
  const double most = bench.scene().scene().guard.max_force_n;
  const double wanted = std::clamp((kObjectNPerMm - target) * kDeepMm, -most, most);
  return std::abs(-record.device_command_n.z - wanted) / std::max(1.0, std::abs(wanted));
}

/// Ticks from the first fit sample after NaN, clear and lift until the scene knows that the tool is free.
double recovered(bool explore, const Effort&) {
  Bench bench(explore);
  bench.press_and_hold();
  hal::RigSample bad = bench.at(-kDeepMm);
  bad.sensor_force_n.y = std::nan("");
  if (rt::norm(bench.tick(bad).device_command_n) != 0.0) return 1e6;
  bench.move(10.0, 10.0, 1);
  bench.scene().renderer().clear();
  int ticks = 0;
  while (bench.tick(bench.at(10.0)).contact_reason != rt::ContactReason::kFree && ticks < 100'000) ++ticks;
  return ticks;
}

/// Commands from anything a sensor and an encoder can say.
double anything(bool explore, const Effort& effort) {
  Bench bench(explore);
  sim::Random random(3);
  const double most = bench.scene().scene().guard.max_force_n;
  Largest beyond;
  const auto any = [&](double usual) {
    const double u = random.uniform();
    if (u < 2e-4) return std::nan("");
    if (u < 4e-4) return std::numeric_limits<double>::infinity();
    if (u < 6e-4) return 1e300;
    return usual * random.normal() * std::pow(10.0, 4.0 * random.uniform() - 3.0);
  };
  const long ticks = effort.ticks(0.3);
  for (long i = 0; i < ticks; ++i) {
    hal::RigSample sample = bench.at(0.0);
    sample.tip_position_mm = {any(10.0), any(10.0), any(10.0)};
    sample.sensor_force_n = {any(2.0), any(2.0), any(2.0)};
    if (random.uniform() < 1e-3) sample.status = hal::sample_status::kForceSaturated;
    if (random.uniform() < 1e-3) bench.period_ns = static_cast<std::int64_t>(2e7 * random.uniform());
    const rt::TickRecord record = bench.tick(sample);
    beyond.see(std::max(0.0, rt::norm(record.device_command_n) - most));
    if (record.in_contact && !std::isfinite(record.displacement_mm)) return std::nan("");
    if (random.uniform() < 0.01) bench.scene().renderer().clear();
  }
  return beyond.value();
}

}  // namespace

ExtremeGroup scene_extremes() {
  ExtremeGroup group{"scenes", "Whole scenes behind the guard, on an object of 0.4 N/mm", {}};
  for (const bool explore : {false, true}) {
    const std::string name = explore ? "scene explore_rod" : "scene tap_1d";
    const auto add = [&](const char* extreme, const char* measured, const char* unit, double bound,
                         const char* because, auto function) {
      group.extremes.push_back({name, extreme, measured, unit, bound, because,
                                [=](const Effort& effort) { return function(explore, effort); }});
    };
    add(explore ? "five hours pressed 4 mm deep" : "ten hours pressed 4 mm deep", "drift of the displacement",
        "mm", explore ? 0.05 * kDeepMm + 0.05 : 1e-9,
        explore ? "law's own error, 5 % and 0.05 mm" : "encoders at rest", held_ten_hours);
    add("six minutes of dither on all axes", "displacement error", "mm", explore ? 0.25 + 0.03 : 0.06,
        explore ? "law's own error and a count" : "two counts", dithered);
    add("period jitters by 30 %, gaps of 5 ms", "displacement error", "mm", explore ? 0.25 : 0.1,
        explore ? "law's own error" : "way until 15 mN is seen: 0.04 mm", uneven);
    add("k~ = 0", "error of the force", "1", 0.05, "(3.3); displacement within 5 %",
        [](bool e, const Effort& effort) { return target_error(e, 0.0, effort); });
    add("k~ = 100 × k", "error of the force", "1", 0.05, "the device's limit",
        [](bool e, const Effort& effort) { return target_error(e, 100.0 * kObjectNPerMm, effort); });
    add("NaN while pressed, lifted, cleared", "ticks until it knows that it is free", "ticks",
        rt::ContactParameters{}.arming_time_ms + 1.0, "arming_time_ms", recovered);
    add("any sample: NaN, ∞, 1e300, saturation, gaps", "force beyond the limit", "N", 1e-12, "max_force_n",
        anything);
  }
  return group;
}

}  // namespace hapticd::study::extremes
