#include "rt/model/models.h"

#include <cmath>
#include <sstream>

namespace hapticd::rt {

namespace {
std::string shown(double value) {
  std::ostringstream text;
  text << value;
  return text.str();
}
}  // namespace

std::optional<double> stiffness_n_per_mm(const ObjectModel& model, double force_n) {
  if (model.creep) {
    constexpr double kAnyRateHz = 1000.0;  // the settled curve knows no time
    const CreepLaw law(model.creep->parameters, kAnyRateHz);
    return force_n / law.curve(force_n).displacement_mm;
  }
  if (model.hunt_crossley) {
    return force_n /
           hunt_crossley_displacement(model.hunt_crossley->parameters, force_n, 0.0).displacement_mm;
  }
  return std::nullopt;
}

std::optional<hal::Error> check_maxwell_slip(const FrictionParameters& friction, const std::string& prefix,
                                             const std::string& where) {
  if (!friction.maxwell_slip) return std::nullopt;
  const MaxwellSlipParameters& elements = *friction.maxwell_slip;
  const auto refuse = [&](const std::string& what, double value, const std::string& limit,
                          hal::ErrorCode code = hal::ErrorCode::kOutOfRange) {
    return hal::Error{
        prefix + what, where, shown(value), limit, "identify the friction again, or fix the file", code};
  };
  for (std::size_t i = 0; i < MaxwellSlipParameters::kElements; ++i) {
    const std::string number = ", element " + std::to_string(i + 1) + ", is out of range";
    if (const double mm = elements.reach_mm[i]; !(mm >= 0.0 && mm <= 1e3)) {
      return refuse("maxwell_slip.reach_mm" + number, mm, "0 … 1000");
    }
    if (const double k = elements.stiffness_per_mm[i]; !(k >= 0.0 && k <= 1e4)) {
      return refuse("maxwell_slip.stiffness_per_mm" + number, k, "0 … 10000");
    }
  }
  const double level = elements.kinetic();
  constexpr double kRounding = 1e-3;
  if (!(level > 0.0) || !(std::abs(friction.kinetic / level - 1.0) <= kRounding)) {
    return refuse("kinetic is not the level of the Maxwell-slip elements", friction.kinetic,
                  shown(level) + ", the sum of reach times stiffness, above 0",
                  hal::ErrorCode::kContradiction);
  }
  return std::nullopt;
}

std::optional<hal::Error> check(const ObjectModel& model) {
  std::optional<hal::Error> error;
  const auto fail = [&](const std::string& key, double value, const std::string& limit) {
    if (!error) {
      error =
          hal::Error::of(hal::ErrorCode::kOutOfRange, key + " is out of range", "model '" + model.name + "'",
                         shown(value), limit, "identify the object again, or fix the file");
    }
  };
  // NaN fails every range.
  const auto range = [&](const std::string& key, double value, double low, double high) {
    if (!(value >= low && value <= high)) fail(key, value, shown(low) + " … " + shown(high));
  };
  range("max_displacement_mm", model.max_displacement_mm, 0.0, 1e3);
  range("max_force_n", model.max_force_n, 0.0, 1e3);
  if (model.hunt_crossley) {
    const HuntCrossleyParameters& law = model.hunt_crossley->parameters;
    range("hunt_crossley.stiffness_n_per_mm_m", law.stiffness_n_per_mm_m, 1e-4, 1e3);
    range("hunt_crossley.damping_n_s_per_mm_m1", law.damping_n_s_per_mm_m1, 0.0, 1e2);
    range("hunt_crossley.exponent", law.exponent, 1.0, 3.0);
    range("hunt_crossley.relative_error", model.hunt_crossley->relative_error, 1e-3, 1.0);
  }
  if (model.creep) {
    const CreepParameters& law = model.creep->parameters;
    double sum = 0.0;
    for (const double w : law.weight) {
      range("creep.weight", w, 0.0, 1e3);
      sum += w;
    }
    range("creep.weight's sum", sum, 1e-3, 1e4);
    for (const double t : law.time_s) range("creep.time_s", t, 1e-4, 1e3);
    range("creep.max_force_n", law.max_force_n, 1e-3, 1e3);
    range("creep.displacement_mm, first", law.displacement_mm[0], 0.0, 0.0);
    for (std::size_t j = 1; j < CreepParameters::kKnots; ++j) {
      range("creep.displacement_mm must rise; knot " + std::to_string(j), law.displacement_mm[j],
            law.displacement_mm[j - 1] + 1e-9, 1e3);
    }
    range("creep.relative_error", model.creep->relative_error, 1e-3, 1.0);
  }
  const auto friction = [&](const std::string& part, const std::optional<FrictionParameters>& found) {
    if (!found) return;
    range(part + ".kinetic", found->kinetic, 0.0, 5.0);
    range(part + ".presliding_mm", found->presliding_mm, 1e-3, 20.0);
    range(part + ".viscous_n_s_per_mm", found->viscous_n_s_per_mm, 0.0, 1.0);
    range(part + ".exponent", found->exponent, 0.0, 3.0);
    range(part + ".presliding_relative_error", found->presliding_relative_error, 0.0, 10.0);
    if (!error) error = check_maxwell_slip(*found, part + ".", "model '" + model.name + "'");
  };
  friction("rod_friction", model.rod_friction);
  friction("bearing_friction", model.bearing_friction);
  if (model.bearing_friction && model.bearing_friction->maxwell_slip && !error) {
    error = hal::Error::of(hal::ErrorCode::kMisplacedKey,
                           "a ball bearing's friction has no Maxwell-slip elements",
                           "model '" + model.name + "'", "bearing_friction.maxwell_slip",
                           "elements under rod_friction only", "leave them out, or give them for the rod");
  }
  return error;
}

}  // namespace hapticd::rt
