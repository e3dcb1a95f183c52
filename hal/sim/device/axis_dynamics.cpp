#include "hal/sim/device/axis_dynamics.h"

#include <Eigen/Dense>
#include <unsupported/Eigen/MatrixFunctions>

namespace hapticd::sim {

AxisDynamics::AxisDynamics(const AxisParameters& p, double step_s) {
  // N / kg = m/s²; the state is in mm.
  const double per_motor = 1e3 / p.motor_mass_kg;
  const double per_tip = 1e3 / p.tip_mass_kg;
  const double k = p.structural_stiffness_n_per_mm;
  const double c = p.structural_damping_n_s_per_mm;

  Eigen::Matrix<double, 6, 6> rate = Eigen::Matrix<double, 6, 6>::Zero();
  rate(0, 1) = 1.0;
  rate(2, 3) = 1.0;
  rate.row(1) << -k * per_motor, -(c + p.motor_viscosity_n_s_per_mm) * per_motor, k * per_motor,
      c * per_motor, per_motor, 0.0;
  rate.row(3) << k * per_tip, c * per_tip, -(k + p.hand_stiffness_n_per_mm) * per_tip,
      -(c + p.hand_damping_n_s_per_mm) * per_tip, 0.0, per_tip;
  const Eigen::Matrix<double, 6, 6> flow = (rate * step_s).exp();
  for (std::size_t row = 0; row < 4; ++row) {
    for (std::size_t column = 0; column < 6; ++column) {
      map_[row][column] = flow(static_cast<Eigen::Index>(row), static_cast<Eigen::Index>(column));
    }
  }
}

}  // namespace hapticd::sim
