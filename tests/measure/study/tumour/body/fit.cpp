// Fits smooth energies to what the soft body answered and prints them as phantom_energy.cpp holds them.

#include <Eigen/Dense>
#include <cstdio>
#include <fstream>
#include <map>
#include <numbers>
#include <string>
#include <vector>

#include "hal/sim/object/reduced_function.h"

namespace {

using hapticd::sim::ReducedFunction;

struct Row {
  double angle_rad = 0.0, depth_mm = 0.0, energy = 0.0, normal = 0.0, tangential = 0.0, x = 0.0, z = 0.0;
};
using Rows = std::map<std::pair<int, int>, Row>;

Rows read(const std::string& path) {
  std::ifstream file(path);
  std::string line;
  std::getline(file, line);
  Rows rows;
  while (std::getline(file, line)) {
    Row r;
    double deg = 0.0;
    if (std::sscanf(line.c_str(), "%lf,%lf,%lf,%lf,%lf,%lf,%lf", &deg, &r.depth_mm, &r.energy, &r.normal,
                    &r.tangential, &r.x, &r.z) != 7)
      continue;
    r.angle_rad = deg * std::numbers::pi / 180.0;
    rows[{static_cast<int>(deg), static_cast<int>(r.depth_mm)}] = r;
  }
  return rows;
}

struct Fit {
  ReducedFunction function;
  double residual = 0.0;  // rms of forces over rms of forces
};

// One function's factors to values (and, for energies, to the forces, which count for 3 mm each).
Fit fit(ReducedFunction shape, std::size_t terms, const std::vector<Row>& rows, bool energy) {
  const auto count = static_cast<Eigen::Index>(ReducedFunction::kPowers * terms);
  const Eigen::Index per_row = energy ? 3 : 1;
  Eigen::MatrixXd a = Eigen::MatrixXd::Zero(per_row * static_cast<Eigen::Index>(rows.size()), count);
  Eigen::VectorXd b(a.rows());
  constexpr double kForceWeightMm = 3.0;
  for (Eigen::Index c = 0; c < count; ++c) {
    ReducedFunction one = shape;
    one.factors = {};
    one.factors[static_cast<std::size_t>(c) / terms][static_cast<std::size_t>(c) % terms] = 1.0;
    for (std::size_t i = 0; i < rows.size(); ++i) {
      const Row& r = rows[i];
      const auto v = one.at(r.depth_mm, r.angle_rad);
      const auto at = per_row * static_cast<Eigen::Index>(i);
      const double distance = 63.0 - r.depth_mm;
      a(at, c) = v.value;
      b[at] = r.energy;
      if (!energy) continue;
      a(at + 1, c) = kForceWeightMm * v.by_depth;
      b[at + 1] = kForceWeightMm * r.normal;
      a(at + 2, c) = -kForceWeightMm * v.by_angle / distance;
      b[at + 2] = kForceWeightMm * r.tangential;
    }
  }
  Eigen::VectorXd scale = a.colwise().norm();
  for (Eigen::Index c = 0; c < count; ++c) a.col(c) /= scale[c];
  const Eigen::VectorXd x = a.colPivHouseholderQr().solve(b);
  const Eigen::VectorXd left = a * x - b;
  Fit result{shape, left.norm() / b.norm()};
  for (Eigen::Index c = 0; c < count; ++c)
    result.function.factors[static_cast<std::size_t>(c) / terms][static_cast<std::size_t>(c) % terms] =
        x[c] / scale[c];
  return result;
}

/// One scale for all depths of the sphere, so that their factors can be mixed.
Fit local_fit(ReducedFunction shape, const std::vector<Row>& rows, bool energy) {
  shape.scale_rad = 0.36;
  return fit(shape, ReducedFunction::kTerms, rows, energy);
}

void print(const char* name, const Fit& f) {
  std::printf("// Left over: %.1f %%.\nconst ReducedFunction %s{{%g, %g, %g, %g}, %.4f, %g,\n    {{",
              100.0 * f.residual, name, f.function.powers[0], f.function.powers[1], f.function.powers[2],
              f.function.powers[3], f.function.scale_rad, f.function.last_depth_mm);
  for (const auto& line : f.function.factors) {
    std::printf("{");
    for (const double v : line) std::printf("%.5g, ", v);
    std::printf("},");
  }
  std::printf("}}};\n\n");
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 3) return 2;
  const Rows tissue = read(argv[1]);
  std::vector<Row> all;
  for (const auto& [key, row] : tissue) all.push_back(row);
  ReducedFunction over_all;
  over_all.powers = {2.0, 2.5, 3.0, 4.0};
  print("kTissue", fit(over_all, 3, all, true));
  for (int i = 2; i < argc; ++i) {
    const std::string depth =
        std::to_string(static_cast<int>(std::atof(argv[i] + std::string(argv[i]).rfind("/d") + 2)));
    std::vector<Row> excess, along, across;
    for (const auto& [key, row] : read(argv[i])) {
      const auto base = tissue.find(key);
      if (base == tissue.end()) continue;
      Row e = row;
      e.energy -= base->second.energy;
      e.normal -= base->second.normal;
      e.tangential -= base->second.tangential;
      excess.push_back(e);
      e.energy = row.z;
      along.push_back(e);
      if (row.angle_rad == 0.0) continue;
      e.energy = row.x / row.angle_rad;
      across.push_back(e);
    }
    ReducedFunction local;
    local.powers = {2.0, 3.0, 4.0, 5.0};
    print(("kExcess" + depth).c_str(), local_fit(local, excess, true));
    local.powers = {1.0, 1.5, 2.0, 3.0};
    print(("kAlong" + depth).c_str(), local_fit(local, along, false));
    print(("kAcross" + depth).c_str(), local_fit(local, across, false));
  }
}
