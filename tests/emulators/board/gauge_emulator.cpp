#include "tests/emulators/board/gauge_emulator.h"

#include <Eigen/Dense>
#include <cmath>
#include <cstdio>

namespace hapticd::emulators {

namespace {

constexpr double kPi = 3.14159265358979323846;
using Matrix = std::array<std::array<double, 6>, 6>;
using Matrix6 = Eigen::Matrix<double, 6, 6, Eigen::RowMajor>;

std::string number(double value, int decimals) {
  char text[64];
  std::snprintf(text, sizeof text, "%.*f", decimals, value);
  return text;
}

}  // namespace

GaugeEmulator::GaugeEmulator() {
  for (std::size_t beam = 0; beam < 3; ++beam) {
    const double angle = 2.0 * kPi * static_cast<double>(beam) / 3.0 + 0.07 * static_cast<double>(beam);
    const double c = std::cos(angle);
    const double s = std::sin(angle);
    // Bending down under Fz and tilting; sideways under Fx, Fy and twisting. Nothing is built perfectly.
    volts_per_load_[2 * beam] = {0.004, -0.003 * s, 0.085, 0.020 * c, 0.020 * s, 0.0006};
    volts_per_load_[2 * beam + 1] = {-0.11 * s, 0.11 * c, 0.002 * c, 0.0005, -0.0004 * s, 0.022};
  }
  Eigen::Map<Matrix6>(load_per_volt_[0].data()) =
      Eigen::Map<const Matrix6>(volts_per_load_[0].data()).inverse();
}

std::array<double, 6> GaugeEmulator::volts(const hal::Vector3& f, const hal::Vector3& t) const {
  const std::array<double, 6> load{f.x, f.y, f.z, t.x, t.y, t.z};
  std::array<double, 6> volts{};
  using Vector6 = Eigen::Matrix<double, 6, 1>;
  Eigen::Map<Vector6>(volts.data()) =
      Eigen::Map<const Matrix6>(volts_per_load_[0].data()) * Eigen::Map<const Vector6>(load.data());
  return volts;
}

std::string GaugeEmulator::calibration_file(const CalibrationFileStyle& style) const {
  const double torque_unit = style.newton_metres ? 1000.0 : 1.0;  // N·mm
  const char* const names[] = {"Fx", "Fy", "Fz", "Tx", "Ty", "Tz"};
  const double most[] = {25.0, 25.0, 35.0, 250.0, 250.0, 250.0};  // N, N·mm
  const double scales[] = {11.3650042, 11.3650042, 5.8934167, 1.8229288, 1.8229288, 1.5742017};

  // Rows as the maker keeps them: at the gauges' own origin and attitude.
  const auto& d = style.transform.displacement_mm;
  const auto& turn = style.transform.rotation_deg;
  const auto about = [](double deg, const Eigen::Vector3d& axis) {
    return Eigen::AngleAxisd(deg * kPi / 180.0, axis);
  };
  const Eigen::Matrix3d back =
      (about(turn[0], Eigen::Vector3d::UnitX()) * about(turn[1], Eigen::Vector3d::UnitY()) *
       about(turn[2], Eigen::Vector3d::UnitZ()))
          .toRotationMatrix();
  const Eigen::Vector3d place(d[0], d[1], d[2]);
  const Eigen::Map<const Matrix6> user(load_per_volt_[0].data());
  Matrix own_rows{};
  Eigen::Map<Matrix6> own(own_rows[0].data());
  for (int gauge = 0; gauge < 6; ++gauge) {
    const Eigen::Vector3d force = back * user.block<3, 1>(0, gauge);
    own.block<3, 1>(0, gauge) = force;
    own.block<3, 1>(3, gauge) = back * user.block<3, 1>(3, gauge) + place.cross(force);
  }

  std::string text = "<?xml version=\"1.0\" encoding=\"utf-8\"?>\n<!-- made up for tests -->\n";
  text +=
      "<FTSensor Serial=\"FT00042\" BodyStyle=\"Nano17\" Family=\"DAQ\" NumGages=\"6\" CalFileVersion=\"" +
      style.version + "\">\n";
  text += "\t<Calibration PartNumber=\"SI-25-0.25\" CalDate=\"1/2/2020\" ForceUnits=\"N\" TorqueUnits=\"" +
          std::string(style.newton_metres ? "N-m" : "N-mm") + "\" DistUnits=\"" +
          (style.newton_metres ? "m" : "mm") +
          "\" OutputMode=\"Ground Referenced Differential\" OutputRange=\"20\" HWTempComp=\"True\" "
          "GainMultiplier=\"1\" CableLossDetection=\"False\" OutputBipolar=\"True\">\n";
  const auto rows = [&](const char* element, const Matrix& matrix, bool scaled) {
    for (std::size_t i = 0; i < 6; ++i) {
      const double unit = i < 3 ? 1.0 : torque_unit;
      text += "\t\t<" + std::string(element) + " Name=\"" + names[i] + "\" values=\"";
      for (std::size_t j = 0; j < 6; ++j) {
        text += " " + number(matrix[i][j] / unit * (scaled ? scales[i] : 1.0), style.decimals);
      }
      text += " \" max=\"" + number(most[i] / unit, 6) + "\"";
      if (scaled) text += " scale=\"" + number(scales[i], 13) + "\"";
      text += "/>\n";
    }
  };
  rows("Axis", own_rows, true);
  const double length_unit = style.newton_metres ? 1000.0 : 1.0;  // mm
  text += "\t\t<BasicTransform Dx=\"" + number(d[0] / length_unit, 9) + "\" Dy=\"" +
          number(d[1] / length_unit, 9) + "\" Dz=\"" + number(d[2] / length_unit, 9) + "\" Rx=\"" +
          number(turn[0], 9) + "\" Ry=\"" + number(turn[1], 9) + "\" Rz=\"" + number(turn[2], 9) + "\"/>\n";
  if (style.version != "1.0") rows("UserAxis", load_per_volt_, false);
  return text + "\t</Calibration>\n</FTSensor>\n";
}

}  // namespace hapticd::emulators
