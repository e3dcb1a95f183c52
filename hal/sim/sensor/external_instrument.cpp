#include "hal/sim/sensor/external_instrument.h"

#include <cmath>
#include <numbers>

namespace hapticd::sim {

double ExternalInstrument::axis(double position_mm, double phase) noexcept {
  const double turn = 2.0 * std::numbers::pi * position_mm / model_.linearity_period_mm;
  const double reported_mm =
      position_mm + model_.linearity_mm * std::sin(turn + phase) + model_.noise_mm * random_.normal();
  return std::round(reported_mm / model_.resolution_mm) * model_.resolution_mm;
}

hal::Vector3 ExternalInstrument::read(const hal::Vector3& tip_mm) noexcept {
  return {axis(tip_mm.x, 0.7), axis(tip_mm.y, 2.9), axis(tip_mm.z, 5.1)};
}

std::vector<hal::UncertainParameter> ExternalInstrumentModel::uncertain() const {
  const char* assumed = "assumed: a share of the 30 µm that an LVDT is given in D§4.6.1";
  return {{"external_noise_mm", noise_mm, "mm", assumed},
          {"external_linearity_mm", linearity_mm, "mm", assumed},
          {"external_linearity_period_mm", linearity_period_mm, "mm", "assumed"},
          {"external_resolution_mm", resolution_mm, "mm", assumed}};
}

}  // namespace hapticd::sim
