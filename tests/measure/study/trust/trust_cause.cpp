#include "tests/measure/study/trust/trust_cause.h"

#include <cstdlib>
#include <filesystem>

#include "tests/support/ticks/tick_sequence.h"
#include "tests/support/value_of.h"

namespace hapticd::study {

namespace {

using sim::SimulationConfig;
using test::TickSequence;

double period_us(const SimulationConfig& rig) {
  return 1e6 / rig.rate_hz;
}
/// Ticks in so long a time; not a multiple of the hand's period, so that the cause meets any phase of it.
int ticks_in(const SimulationConfig& rig, double seconds) {
  return static_cast<int>(seconds * rig.rate_hz);
}
void play(SimulationConfig& rig, const TickSequence& ticks) {
  rig.ticks = ticks.shared();
}
void replay(SimulationConfig& rig, const char* name) {
  play(rig, test::value_of(TickSequence::load(*recorded_ticks(name))).at_rate(1000.0, rig.rate_hz));
}
void set(SimulationConfig& rig, const char* name, double value) {
  rig.condition_values[name] = value;
}
/// A direction that depends on the seed alone, not always an axis.
hal::Vector3 direction(std::uint64_t seed) {
  constexpr hal::Vector3 kDirections[] = {{0.0, 0.0, 1.0},  {0.0, 0.0, -1.0}, {0.6, 0.0, 0.8},
                                          {0.0, -0.8, 0.6}, {1.0, 0.0, 0.0},  {-0.6, 0.48, -0.64}};
  return kDirections[seed % 6];
}
void happens(SimulationConfig& rig, sim::ObjectEvent event) {
  constexpr double kAtS = 6.0;
  event.at_s = kAtS;
  rig.object_events.push_back(event);
}

std::string text(double value) {
  std::string digits = std::to_string(value);
  digits.erase(digits.find_last_not_of('0') + 1);
  if (digits.back() == '.') digits.pop_back();
  return digits;
}

std::vector<TrustCause> make_causes() {
  using Apply = void (*)(SimulationConfig&, double);
  std::vector<TrustCause> all;
  const auto add = [&all](const char* name, std::vector<double> values, const char* unit, Apply apply,
                          std::vector<double> tested = {}) -> void {
    for (const double value : values) {
      TrustCause cause;
      cause.name = name;
      cause.level = text(value) + " " + unit;
      cause.apply = apply;
      cause.value = value;
      for (const double t : tested) cause.in_test = cause.in_test || t == value;
      all.push_back(cause);
    }
  };
  const auto single = [&all](const char* name, Apply apply, bool tested = false) -> TrustCause& {
    TrustCause cause;
    cause.name = name;
    cause.apply = apply;
    cause.in_test = tested;
    all.push_back(cause);
    return all.back();
  };

  single(
      "nothing", [](SimulationConfig&, double) {}, true);
  single(
      "abrupt_hand", [](SimulationConfig&, double) {}, true)
      .motion = TrustMotion::kAbrupt;
  single("abrupt_hand_late_ticks", [](SimulationConfig& rig, double) {
    play(rig, TickSequence::late(period_us(rig), 950.0, ticks_in(rig, 0.0137)));
  }).motion = TrustMotion::kAbrupt;
  add("late_tick", {0.1, 0.3, 0.5, 0.95, 1.7, 3, 5, 10, 17, 25, 45, 70, 120, 200}, "ms",
      [](SimulationConfig& rig, double ms) {
        play(rig, TickSequence::late(period_us(rig), 1e3 * ms, ticks_in(rig, 0.337 + 2e-3 * ms)));
      },
      {0.3, 0.95, 1.7, 5, 17, 45, 200});
  add("missing_ticks", {1, 2, 5, 15}, "ticks",
      [](SimulationConfig& rig, double count) {
        play(rig, TickSequence::late(period_us(rig), count * period_us(rig), ticks_in(rig, 0.213)));
      },
      {2});
  add("burst_of_five_late", {0.3, 0.95, 1.7, 5, 20}, "ms",
      [](SimulationConfig& rig, double ms) {
        play(rig, TickSequence::bursts(period_us(rig), 1e3 * ms, 5, ticks_in(rig, 0.471)));
      },
      {1.7});
  if (recorded_ticks("idle")) {
    single("recorded_idle", [](SimulationConfig& rig, double) { replay(rig, "idle"); }).duration_s = 60.0;
    single("recorded_loaded", [](SimulationConfig& rig, double) { replay(rig, "loaded"); }).duration_s = 60.0;
  }
  add("sensor_bunched", {1, 2, 5, 20, 60}, "ms",
      [](SimulationConfig& rig, double ms) {
        play(rig, TickSequence::bunched(period_us(rig), 1e3 * ms, ticks_in(rig, 0.293)));
      },
      {1, 5});
  add("sensor_lost", {1, 5, 20}, "ms",
      [](SimulationConfig& rig, double ms) {
        play(rig, TickSequence::lost(period_us(rig), ticks_in(rig, 1e-3 * ms), ticks_in(rig, 0.293)));
      },
      {1});
  add("sensor_late", {0.5, 1, 2, 3}, "ms",
      [](SimulationConfig& rig, double ms) { set(rig, "sensor_delay_ms", ms); }, {1, 3});
  add("encoders_late", {0.5, 1, 2, 3}, "ms",
      [](SimulationConfig& rig, double ms) { set(rig, "encoder_delay_ms", ms); }, {3});
  add("sensor_late_told", {1, 3}, "ms", [](SimulationConfig& rig, double ms) {
    set(rig, "sensor_delay_ms", ms);
    set(rig, "delays_reported", 1.0);
  });
  const std::size_t drifts = all.size();
  add("zero_drift", {1, 2}, "mN/s",
      [](SimulationConfig& rig, double mn_per_s) {
        set(rig, "sensor_drift_n_per_s", 1e-3 * mn_per_s);
        set(rig, "sensor_drift_bound_n", 0.1);
      },
      {2});
  for (std::size_t i = drifts; i < all.size(); ++i) all[i].duration_s = 60.0;
  const std::size_t left = all.size();
  add("zero_drift_left", {1, 2, 5}, "mN/s",
      [](SimulationConfig& rig, double mn_per_s) {
        set(rig, "sensor_drift_n_per_s", 1e-3 * mn_per_s);
        set(rig, "sensor_drift_bound_n", 0.3);
      },
      {2});
  for (std::size_t i = left; i < all.size(); ++i) {
    all[i].motion = TrustMotion::kLeave;
    all[i].needs_object = true;
    all[i].duration_s = 42.0;
  }
  single("zero_wander", [](SimulationConfig& rig, double) {
    set(rig, "sensor_drift_n_per_s", 2e-3);
    set(rig, "sensor_drift_wanders", 1.0);
  }).duration_s = 60.0;
  static const std::vector<double> kJumpsN{0.05, 0.1, 0.15, 0.2, 0.3, 0.5, 1, 2, 3};
  add("zero_jump", kJumpsN, "N",
      [](SimulationConfig& rig, double newtons) {
        set(rig, "sensor_step_n", newtons);
        set(rig, "sensor_step_interval_s", 3.3);
      },
      {0.3, 1});
  add("zero_jump_each_second", kJumpsN, "N",
      [](SimulationConfig& rig, double newtons) {
        set(rig, "sensor_step_n", newtons);
        set(rig, "sensor_step_interval_s", 0.97);
      },
      {0.15, 3});
  const std::size_t touched = all.size();
  add("zero_jump_touched", kJumpsN, "N",
      [](SimulationConfig& rig, double newtons) {
        set(rig, "sensor_step_n", newtons);
        set(rig, "sensor_step_interval_s", 0.73);
      },
      {0.2, 0.5, 2});
  for (std::size_t i = touched; i < all.size(); ++i) {
    all[i].motion = TrustMotion::kPressOften;
    all[i].needs_object = true;
  }
  const std::size_t jumps_left = all.size();
  add("zero_jump_left", kJumpsN, "N",
      [](SimulationConfig& rig, double newtons) {
        set(rig, "sensor_step_n", newtons);
        set(rig, "sensor_step_interval_s", 0.73);
      },
      {0.3});
  for (std::size_t i = jumps_left; i < all.size(); ++i) {
    all[i].motion = TrustMotion::kLeave;
    all[i].needs_object = true;
    all[i].duration_s = 42.0;
  }
  const std::size_t frozen = all.size();
  add("sensor_frozen", {0.8, 1.2, 1.6, 2.5, 4.5}, "s",
      [](SimulationConfig& rig, double at_s) { set(rig, "sensor_frozen_at_s", at_s); }, {1.6});
  for (std::size_t i = frozen; i < all.size(); ++i) {
    all[i].motion = TrustMotion::kPressOften;
    all[i].needs_object = true;
  }
  add("zero_step", {20, 50}, "mN",
      [](SimulationConfig& rig, double mn) {
        set(rig, "sensor_step_n", 1e-3 * mn);
        set(rig, "sensor_step_interval_s", 2.3);
      },
      {50});
  add("tool_mass_wrong", {-20, 20}, "percent",
      [](SimulationConfig& rig, double percent) { set(rig, "tool_mass_error_share", 1e-2 * percent); },
      {-20, 20});
  add("bias_wrong", {20, 100, 160, 300}, "mN",
      [](SimulationConfig& rig, double mn) {
        const hal::Vector3 d = direction(rig.seed) * (1e-3 * mn);
        set(rig, "bias_error_x_n", d.x);
        set(rig, "bias_error_y_n", d.y);
        set(rig, "bias_error_z_n", d.z);
      },
      {100, 160});
  add("tool_tilted", {10, 30, 60}, "°",
      [](SimulationConfig& rig, double deg) {
        set(rig, "tool_tilt_deg", deg);
        set(rig, "tool_tilt_at_s", 3.0);
      },
      {30});
  single("tool_tilted_gimbal_wrong", [](SimulationConfig& rig, double) {
    set(rig, "tool_tilt_deg", 30.0);
    set(rig, "tool_tilt_at_s", 3.0);
    set(rig, "orientation_error_deg", 3.0);
  });
  add("crosstalk", {2}, "percent",
      [](SimulationConfig& rig, double percent) { set(rig, "sensor_crosstalk_share", 1e-2 * percent); });
  add("table_knocked", {0.3, 1}, "m/s²",
      [](SimulationConfig& rig, double m_per_s2) {
        set(rig, "vibration_m_per_s2", m_per_s2);
        set(rig, "vibration_interval_s", 0.83);
      },
      {1});
  add("table_shaken", {1}, "m/s²", [](SimulationConfig& rig, double m_per_s2) {
    set(rig, "vibration_m_per_s2", m_per_s2);
    set(rig, "vibration_interval_s", 0.0);
  });
  const auto in_the_lab = [&](const char* name, Apply apply, bool tested) {
    TrustCause& cause = single(name, apply, tested);
    cause.motion = TrustMotion::kBoth;
    cause.duration_s = 40.0;
  };
  in_the_lab(
      "lab", [](SimulationConfig& rig, double) { rig.conditions = "lab"; }, true);
  if (recorded_ticks("loaded")) {
    in_the_lab(
        "lab_on_a_loaded_machine",
        [](SimulationConfig& rig, double) {
          rig.conditions = "lab";
          replay(rig, "loaded");
        },
        false);
  }

  const auto on_object = [&](const char* name, TrustMotion motion, Apply apply, bool tested) {
    TrustCause& cause = single(name, apply, tested);
    cause.motion = motion;
    cause.needs_object = true;
  };
  on_object(
      "object_vanishes", TrustMotion::kPress,
      [](SimulationConfig& rig, double) { happens(rig, {.kind = sim::ObjectEvent::Kind::kVanish}); }, true);
  on_object(
      "object_moved_down", TrustMotion::kPress,
      [](SimulationConfig& rig, double) {
        happens(rig, {.kind = sim::ObjectEvent::Kind::kMove, .move_mm = {0.0, 0.0, -5.0}});
      },
      true);
  on_object(
      "object_moved_aside", TrustMotion::kPress,
      [](SimulationConfig& rig, double) {
        happens(rig, {.kind = sim::ObjectEvent::Kind::kMove, .move_mm = {5.0, 0.0, -0.5}});
      },
      true);
  on_object(
      "object_drawn_away", TrustMotion::kPress,
      [](SimulationConfig& rig, double) {
        happens(rig,
                {.kind = sim::ObjectEvent::Kind::kMove, .move_mm = {0.0, 0.0, -30.0}, .duration_s = 0.3});
      },
      true);
  for (const double force_n : {0.06, 0.1, 0.16, 0.3, 0.4, 1.0, 2.0, 3.0}) {
    TrustCause& cause = single("biased_while_pressed", [](SimulationConfig&, double) {});
    cause.level = text(force_n) + " N";
    cause.motion = TrustMotion::kPressOften;
    cause.needs_object = true;
    cause.biased_at_n = force_n;
    cause.in_test = force_n == 0.16 || force_n == 1.0;
  }
  on_object(
      "slid_off_its_edge", TrustMotion::kStroke,
      [](SimulationConfig& rig, double) { rig.hold.edge_mm = 12.0; }, true);
  const Apply noisy = [](SimulationConfig& rig, double mn) { set(rig, "sensor_noise_n", 1e-3 * mn); };
  add("sensor_noise", {5, 10, 15, 20}, "mN", noisy, {10, 20});
  const std::size_t noisy_touched = all.size();
  add("sensor_noise_touched", {5, 10, 15, 20}, "mN", noisy, {10, 20});
  for (std::size_t i = noisy_touched; i < all.size(); ++i) {
    all[i].motion = TrustMotion::kPressOften;
    all[i].needs_object = true;
  }
  return all;
}

}  // namespace

std::optional<std::string> recorded_ticks(const std::string& name) {
  const char* folder = std::getenv("HAPTICD_RECORDINGS");
  if (folder == nullptr) return std::nullopt;
  const std::string path = std::string(folder) + "/tick_intervals/" + name + ".csv";
  if (!std::filesystem::exists(path)) return std::nullopt;
  return path;
}

const std::vector<TrustCause>& trust_causes() {
  static const std::vector<TrustCause> all = make_causes();
  return all;
}

}  // namespace hapticd::study
