#include "hal/nano17_calibration.h"

#include <array>

namespace hapticd::hal {

namespace {

constexpr std::array<Nano17Calibration, 3> kCalibrations{{
    {"nano17_si_12", "SI-12-0.12", 12.0, 17.0, 120.0, 1.0 / 320.0, 1.0 / 64.0},
    {"nano17_si_25", "SI-25-0.25", 25.0, 35.0, 250.0, 1.0 / 160.0, 1.0 / 32.0},
    {"nano17_si_50", "SI-50-0.5", 50.0, 70.0, 500.0, 1.0 / 80.0, 1.0 / 16.0},
}};

}  // namespace

std::span<const Nano17Calibration> nano17_calibrations() {
  return kCalibrations;
}

Result<Nano17Calibration> find_nano17_calibration(std::string_view model, std::string_view where) {
  std::string known;
  for (const Nano17Calibration& calibration : kCalibrations) {
    if (model == calibration.model || model == calibration.name) return calibration;
    known += (known.empty() ? "" : ", ") + std::string(calibration.model);
  }
  return Error{.what = "there is no such calibration of a Nano17",
               .where = std::string(where),
               .value = "'" + std::string(model.substr(0, 40)) + "'",
               .limit = known,
               .remedy = "name the one on the sensor's calibration certificate",
               .code = ErrorCode::kUnknownWord};
}

}  // namespace hapticd::hal
