// Presses the soft body all over and prints what it answers: the data that phantom_energy.cpp is fitted to.

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <numbers>

#include "tests/measure/study/tumour/body/soft_body.h"

int main(int argc, char** argv) {
  using namespace hapticd::study;
  if (argc < 3) {
    std::fprintf(stderr, "usage: %s LAYERS DEPTH_OF_INCLUSION_MM (0 = none) [LAST_ANGLE_DEG]\n", argv[0]);
    return 2;
  }
  SoftBodyParameters p;
  p.layers = std::atoi(argv[1]);
  p.inclusion_depth_mm = std::atof(argv[2]);
  if (p.inclusion_depth_mm > 0.0) {
    p.inclusion_radius_mm = 12.5;
    p.inclusion_factor = 100.0;
  }
  // EcoFlex 00-30 with 50 % thinner, Yeoh of third order, true stress (kPa).
  p.yeoh_n_per_mm2 = {4.5198e-3, 1.3426e-5, 9.7177e-5};
  const double last_deg = argc > 3 ? std::atof(argv[3]) : 42.0;
  std::printf("angle_deg,depth_mm,energy_n_mm,normal_n,tangential_n,inclusion_x_mm,inclusion_z_mm\n");
  for (double deg = 0.0; deg <= last_deg; deg += 7.0) {
    const double a = deg * std::numbers::pi / 180.0;
    const Eigen::Vector3d out{std::sin(a), 0.0, std::cos(a)}, on{std::cos(a), 0.0, -std::sin(a)};
    SoftBody body(p);
    for (double depth = 3.0; depth <= 18.0; depth += 3.0) {
      if (!body.press(out * (p.radius_mm + p.tip_radius_mm - depth))) break;
      const SoftBodyState s = body.state();
      std::printf("%g,%g,%.6g,%.6g,%.6g,%.6g,%.6g\n", deg, depth, s.energy_n_mm, s.force_n.dot(out),
                  s.force_n.dot(on), s.inclusion_mm[0], s.inclusion_mm[2]);
      std::fflush(stdout);
    }
  }
}
