#include "tests/measure/study/identify/ceres_reference.h"

#ifdef HAPTICD_HAS_CERES
#include <ceres/ceres.h>

#include <array>
#include <cmath>
#include <vector>
#endif

namespace hapticd::study {

#ifdef HAPTICD_HAS_CERES

namespace {

struct Row {
  double displacement_mm, log_displacement, rate_mm_per_s, force_n;
};

/// Residual and derivatives of a sample; parameters K, B, m.
void evaluate(const Row& row, const double* p, double& residual, double* jacobian) {
  const double power = std::exp(p[2] * row.log_displacement);
  const double force_n = (p[0] + p[1] * row.rate_mm_per_s) * power;
  residual = force_n - row.force_n;
  if (jacobian == nullptr) return;
  jacobian[0] = power;
  jacobian[1] = power * row.rate_mm_per_s;
  jacobian[2] = force_n * row.log_displacement;
}

class SampleCost final : public ceres::SizedCostFunction<1, 3> {
 public:
  explicit SampleCost(const Row& row) : row_(row) {}
  bool Evaluate(double const* const* parameters, double* residuals, double** jacobians) const override {
    evaluate(row_, parameters[0], residuals[0], jacobians != nullptr ? jacobians[0] : nullptr);
    return true;
  }

 private:
  Row row_;
};

}  // namespace

hal::Result<identification::HuntCrossleyEstimate> fit_with_ceres(
    std::span<const identification::PalpationSample> palpation) {
  std::vector<Row> rows;
  rows.reserve(palpation.size());
  Row deepest{};
  for (const identification::PalpationSample& s : palpation) {
    if (!identification::identifies_contact(s)) continue;
    rows.push_back({s.displacement_mm, std::log(s.displacement_mm), s.rate_mm_per_s, s.normal_force_n});
    if (s.displacement_mm > deepest.displacement_mm) deepest = rows.back();
  }
  if (rows.size() < 30)
    return hal::Error{"too few samples", "batch reference", std::to_string(rows.size()), "30", ""};

  constexpr double kStartExponent = 1.5;
  std::array<double, 3> parameters{deepest.force_n / std::exp(kStartExponent * deepest.log_displacement), 0.0,
                                   kStartExponent};
  ceres::Problem problem;
  for (const Row& row : rows) problem.AddResidualBlock(new SampleCost(row), nullptr, parameters.data());
  problem.SetParameterLowerBound(parameters.data(), 1, 0.0);
  ceres::Solver::Options options;
  options.linear_solver_type = ceres::DENSE_NORMAL_CHOLESKY;  // three parameters: the cheapest there is
  options.num_threads = 1;
  options.logging_type = ceres::SILENT;
  options.max_num_iterations = 100;
  ceres::Solver::Summary summary;
  ceres::Solve(options, &problem, &summary);
  if (!summary.IsSolutionUsable())
    return hal::Error{"no solution", "batch reference", summary.message, "", ""};
  return identification::HuntCrossleyEstimate{
      {parameters[0], parameters[1], parameters[2]}, 0.0, rows.size()};
}

#else

hal::Result<identification::HuntCrossleyEstimate> fit_with_ceres(
    std::span<const identification::PalpationSample>) {
  return hal::Error{"the study was built without Ceres", "batch reference", "", "",
                    "install libceres-dev and build again"};
}

#endif

}  // namespace hapticd::study
