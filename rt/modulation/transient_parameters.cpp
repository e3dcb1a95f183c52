#include "rt/modulation/transient_parameters.h"

#include <algorithm>

namespace hapticd::rt {

namespace {

struct TransientRange {
  std::string key;
  double value, low, high;
  const char* unit;
  const char* remedy = "";
};

void add_ranges(const std::vector<TransientMode>& modes, const std::string& name, double highest_hz,
                std::vector<TransientRange>& ranges) {
  for (std::size_t i = 0; i < modes.size(); ++i) {
    const std::string at = name + "[" + std::to_string(i) + "].";
    ranges.push_back({at + "frequency_hz", modes[i].frequency_hz, 10.0, highest_hz,
                      "Hz (at this rate of the loop; beyond it a tick is too long)",
                      "a softer material, if the scene names one, a lower frequency, or a faster loop"});
    ranges.push_back({at + "decay_per_s", modes[i].decay_per_s, 30.0, 1000.0, "1/s"});
    ranges.push_back({at + "gain_per_s", modes[i].gain_per_s, 0.0, 1000.0, "1/s"});
  }
}

}  // namespace

double highest_transient_hz(double rate_hz) noexcept {
  constexpr double kOfRate = 0.15;
  constexpr double kHighestHz = 300.0;
  return std::min(kHighestHz, kOfRate * rate_hz);
}

std::optional<hal::Error> check(const TransientParameters& transient, double rate_hz,
                                const std::string& prefix, const std::string& where) {
  constexpr std::size_t kMax = TransientParameters::kMaxModes;
  if (transient.target.empty() || transient.target.size() > kMax || transient.real.size() > kMax) {
    return hal::Error::of(
        hal::ErrorCode::kOutOfRange, "a transient has 1 … 3 modes", where,
        std::to_string(transient.target.size()) + " and " + std::to_string(transient.real.size()),
        prefix + "material, or 1 … 3 of " + prefix + "mode; 0 … 3 of " + prefix + "real", "");
  }
  const GripDynamics& g = transient.grip;
  std::vector<TransientRange> ranges{
      {"max_force_n", transient.max_force_n, 0.01, 20.0, "N"},
      {"mode_hz", g.mode_hz, 10.0, 2000.0, "Hz"},
      {"amplifier_hz", g.amplifier_hz, 50.0, 1e5, "Hz"},
      {"grip_mass_g", g.grip_mass_g, 1.0, 1000.0, "g"},
      {"grip_stiffness_n_per_mm", g.grip_stiffness_n_per_mm, 0.0, 100.0, "N/mm"},
      {"grip_damping_n_s_per_mm", g.grip_damping_n_s_per_mm, 0.0, 1.0, "N·s/mm"},
      {"object_stiffness_n_per_mm", g.object_stiffness_n_per_mm, 0.0, 100.0, "N/mm"}};
  add_ranges(transient.target, "mode", highest_transient_hz(rate_hz), ranges);
  add_ranges(transient.real, "real", highest_transient_hz(rate_hz), ranges);
  for (const TransientRange& r : ranges) {
    if (r.value >= r.low && r.value <= r.high) continue;
    return hal::Error::of(hal::ErrorCode::kOutOfRange, prefix + r.key + " is out of range", where,
                          std::to_string(r.value),
                          std::to_string(r.low) + " … " + std::to_string(r.high) + " " + r.unit, r.remedy);
  }
  return std::nullopt;
}

}  // namespace hapticd::rt
