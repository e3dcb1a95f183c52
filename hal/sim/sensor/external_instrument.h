#pragma once

#include <cstdint>
#include <vector>

#include "hal/rig.h"
#include "hal/sim/base/random.h"

namespace hapticd::sim {

/// An instrument next to the device that sees where the tip really is, as the LVDT of D§4.6.1 (30 µm). How
/// those 30 µm are made up is not reported there: assumed here, and reported.
struct ExternalInstrumentModel {
  double noise_mm = 0.005;      ///< standard deviation of one reading, each axis
  double linearity_mm = 0.015;  ///< amplitude of the calibration's error, periodic along each axis
  double linearity_period_mm = 23.0;
  double resolution_mm = 0.001;

  std::vector<hal::UncertainParameter> uncertain() const;
};

/// Readings of such an instrument. Has its own random stream: nothing else changes for being watched.
class ExternalInstrument {
 public:
  ExternalInstrument(const ExternalInstrumentModel& model, std::uint64_t seed)
      : model_(model), random_(seed) {}
  hal::Vector3 read(const hal::Vector3& tip_mm) noexcept;

 private:
  double axis(double position_mm, double phase) noexcept;

  ExternalInstrumentModel model_;
  Random random_;
};

}  // namespace hapticd::sim
