#include "server/identification/estimate/structural/structural_fit.h"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <span>
#include <string>

#include "rt/signal/vector.h"
#include "server/linear_algebra/linear_algebra.h"

namespace hapticd::identification {

namespace {

using Matrix = Eigen::MatrixXd;
using Vector = Eigen::VectorXd;
using Index = Eigen::Index;

// Sums are taken about a fixed origin, in the middle of a device's workspace, and in units that keep them of
// the same order.
constexpr hal::Vector3 kOriginMm{0.0, 0.0, 70.0};
constexpr double kScaleMm = 50.0;
constexpr double kFrictionUnit = 0.1;
constexpr double kDelayUnit = 1e-2;

constexpr double kIndependentS = 0.25;  // residuals closer than this resemble each other
constexpr double kOutlierPress = 4.0;   // times the median press's residual
constexpr double kSingular = 1e-7;      // of the scaled normal matrix
constexpr auto kDeflection = static_cast<Index>(StructuralSums::kRegressors);
constexpr auto kAll = static_cast<Index>(StructuralSums::kRegressors + 1);

double component(const hal::Vector3& v, std::size_t i) noexcept {
  return i == 0 ? v.x : i == 1 ? v.y : v.z;
}
constexpr int columns_of_order(int order) noexcept {
  return order == 0 ? 1 : order == 1 ? 4 : 10;
}
std::size_t packed(std::size_t row, std::size_t column) noexcept {  // row >= column
  return row * (row + 1) / 2 + column;
}

/// Row of the field's polynomial, c(p)/c at the origin.
std::array<double, 10> polynomial(const hal::Vector3& place_mm) noexcept {
  const hal::Vector3 q = (place_mm - kOriginMm) * (1.0 / kScaleMm);
  return {
      1.0, q.x, q.y, q.z, q.x * q.x, q.y * q.y, q.z * q.z, 2.0 * q.x * q.y, 2.0 * q.x * q.z, 2.0 * q.y * q.z};
}

/// One press about its own mean: its offset drops out.
struct CentredPress {
  Matrix products;
  double rows;
  const StructuralPress* press;
};

CentredPress centred(const StructuralPress& press) {
  const StructuralSums& sums = press.axes[static_cast<std::size_t>(press.axis)];
  Matrix products(kAll, kAll);
  for (std::size_t i = 0; i <= StructuralSums::kRegressors; ++i) {
    for (std::size_t j = 0; j <= i; ++j) {
      const double value = sums.product[packed(i, j)] - sums.sum[i] * sums.sum[j] / sums.rows;
      products(static_cast<Index>(i), static_cast<Index>(j)) = value;
      products(static_cast<Index>(j), static_cast<Index>(i)) = value;
    }
  }
  return {std::move(products), sums.rows, &press};
}

/// Least-squares fit with a field of one order.
class OrderFit {
 public:
  OrderFit(std::span<const CentredPress> presses, int order) : presses_(presses), order_(order) {
    for (int i = 0; i < columns_of_order(order); ++i) columns_.push_back(i);
    columns_.push_back(10);
    columns_.push_back(11);
    count_ = static_cast<Index>(columns_.size());
  }

  /// False if the presses do not determine the field.
  bool solve() {
    kept_.assign(presses_.size(), true);
    if (!solve_kept()) return false;
    if (presses_.size() < 5 || !leave_outliers_out()) return theta_.size() > 0;
    return solve_kept() && theta_.size() > 0;
  }
  void judge(double rate_hz);
  /// Fills all but the model's covered range; false if no compliance was found.
  bool unpack(const hal::Vector3& centre_mm, StructuralFit& result) const;

 private:
  Index column(Index i) const { return columns_[static_cast<std::size_t>(i)]; }
  bool solve_kept();
  bool invert();
  std::vector<double> residuals() const;
  bool leave_outliers_out();
  Matrix grouped_covariance() const;
  double variance_of(const Vector& direction) const {
    return std::max(direction.dot(plain_ * direction), direction.dot(grouped_ * direction));
  }
  Vector field_at(const hal::Vector3& place_mm) const;
  void unpack_field(const hal::Vector3& centre_mm, double compliance, StructuralFit& result) const;
  double spread(double compliance) const;

  std::span<const CentredPress> presses_;
  int order_;
  std::vector<Index> columns_;
  Index count_ = 0;
  std::vector<bool> kept_;
  Matrix normal_, inverse_;
  Vector theta_;
  double rows_ = 0.0, square_ = 0.0, explained_ = 0.0;
  Matrix plain_, grouped_;  ///< covariances of theta_, two ways
};

bool OrderFit::solve_kept() {
  normal_ = Matrix::Zero(count_, count_);
  Vector right = Vector::Zero(count_);
  rows_ = square_ = explained_ = 0.0;
  double total = 0.0;
  for (std::size_t p = 0; p < presses_.size(); ++p) {
    if (!kept_[p]) continue;
    const Matrix& products = presses_[p].products;
    for (Index i = 0; i < count_; ++i) {
      right(i) += products(column(i), kDeflection);
      for (Index j = 0; j < count_; ++j) normal_(i, j) += products(column(i), column(j));
    }
    total += products(kDeflection, kDeflection);
    rows_ += presses_[p].rows - 1.0;
  }
  if (!std::isfinite(total) || !invert()) return false;
  theta_ = inverse_ * right;
  square_ = std::max(0.0, total - 2.0 * theta_.dot(right) + theta_.dot(normal_ * theta_));
  explained_ = total;
  return true;
}

bool OrderFit::invert() {
  Vector scale = normal_.diagonal().cwiseMax(0.0).cwiseSqrt();
  for (Index i = 0; i < count_; ++i) {
    if (!(scale(i) > 0.0)) scale(i) = 1.0;
  }
  const Matrix scaled = scale.cwiseInverse().asDiagonal() * normal_ * scale.cwiseInverse().asDiagonal();
  const linear_algebra::SymmetricEigen eigen = linear_algebra::symmetric_eigen(scaled);
  if (!eigen.converged) return false;
  Vector gains(count_);
  for (Index i = 0; i < count_; ++i) {
    // Friction and delay may be left alone if the data do not show them; the compliance may not.
    const double e = eigen.values(i);
    gains(i) = e > kSingular ? 1.0 / e : 0.0;
    if (e <= kSingular && eigen.vectors.col(i).head(columns_of_order(order_)).cwiseAbs().maxCoeff() > 1e-3) {
      return false;
    }
  }
  inverse_ = scale.cwiseInverse().asDiagonal() * eigen.vectors * gains.asDiagonal() *
             eigen.vectors.transpose() * scale.cwiseInverse().asDiagonal();
  return true;
}

/// Residual (rms) of each press.
std::vector<double> OrderFit::residuals() const {
  std::vector<double> rms;
  for (const CentredPress& press : presses_) {
    double own = press.products(kDeflection, kDeflection);
    for (Index i = 0; i < count_; ++i) {
      own -= 2.0 * theta_(i) * press.products(column(i), kDeflection);
      for (Index j = 0; j < count_; ++j) own += theta_(i) * theta_(j) * press.products(column(i), column(j));
    }
    rms.push_back(std::sqrt(std::max(0.0, own) / press.rows));
  }
  return rms;
}

/// True if some were left out and the rest is to be fitted again.
bool OrderFit::leave_outliers_out() {
  const std::vector<double> rms = residuals();
  std::vector<double> sorted = rms;
  const auto middle = sorted.begin() + static_cast<std::ptrdiff_t>(sorted.size() / 2);
  std::nth_element(sorted.begin(), middle, sorted.end());
  std::size_t left_out = 0;
  for (std::size_t p = 0; p < presses_.size(); ++p) {
    kept_[p] = rms[p] <= kOutlierPress * *middle + 1e-9;
    if (!kept_[p]) ++left_out;
  }
  // A fifth of the presses may be wrong; more than that, and it is the model that is.
  if (left_out > 0 && 5 * left_out <= presses_.size()) return true;
  kept_.assign(presses_.size(), true);
  return false;
}

void OrderFit::judge(double rate_hz) {
  const double independent = std::max(1.0, rows_ / (kIndependentS * rate_hz));
  const double degrees = std::max(1.0, independent - static_cast<double>(count_));
  plain_ = inverse_ * (square_ / rows_ * independent / degrees) * (rows_ / independent);
  grouped_ = grouped_covariance();
}

Matrix OrderFit::grouped_covariance() const {
  Matrix scores = Matrix::Zero(count_, count_);
  double groups = 0.0;
  for (std::size_t p = 0; p < presses_.size(); ++p) {
    if (!kept_[p]) continue;
    const Matrix& products = presses_[p].products;
    Vector score(count_);
    for (Index i = 0; i < count_; ++i) {
      score(i) = products(column(i), kDeflection);
      for (Index j = 0; j < count_; ++j) score(i) -= products(column(i), column(j)) * theta_(j);
    }
    scores += score * score.transpose();
    groups += 1.0;
  }
  const double spare = groups - columns_of_order(order_);
  if (spare < 1.0) return Matrix::Zero(count_, count_);
  return inverse_ * scores * inverse_ * (groups / spare);
}

Vector OrderFit::field_at(const hal::Vector3& place_mm) const {
  const std::array<double, 10> field = polynomial(place_mm);
  Vector direction = Vector::Zero(count_);
  for (int i = 0; i < columns_of_order(order_); ++i) direction(i) = field[static_cast<std::size_t>(i)];
  return direction;
}

bool OrderFit::unpack(const hal::Vector3& centre_mm, StructuralFit& result) const {
  const Vector centre = field_at(centre_mm);
  const double compliance = centre.dot(theta_);
  const double variance = variance_of(centre);
  if (!(compliance > 0.0) || !std::isfinite(compliance) || !std::isfinite(variance)) return false;

  result.model.stiffness_n_per_mm = 1.0 / compliance;
  result.model.centre_mm = centre_mm;
  result.centre_error = std::sqrt(variance) / compliance;
  for (const CentredPress& press : presses_) {
    const Vector place = field_at(press.press->place_mm);
    result.worst_error =
        std::max(result.worst_error, std::sqrt(variance_of(place)) / std::abs(place.dot(theta_)));
  }
  result.parameters.push_back(
      {"structural_stiffness_n_per_mm", "N/mm", 1.0 / compliance, result.centre_error / compliance});
  unpack_field(centre_mm, compliance, result);

  Vector friction = Vector::Zero(count_);
  friction(count_ - 2) = 1.0;
  const double friction_error = std::sqrt(variance_of(friction)) * kFrictionUnit / compliance;
  result.parameters.push_back({"back_drive_friction_n", "N", kFrictionUnit * theta_(count_ - 2) / compliance,
                               friction_error > 0.0 ? friction_error : HUGE_VAL});

  result.spread = spread(compliance);
  result.residual = explained_ > 0.0 ? std::sqrt(square_ / explained_) : 0.0;
  result.residual_mm = std::sqrt(square_ / rows_);
  result.left_out = static_cast<std::size_t>(std::count(kept_.begin(), kept_.end(), false));
  result.order = order_;
  result.good = true;
  return true;
}

/// Unpacks the polynomial about the centre of what was covered, from that about the fixed origin.
void OrderFit::unpack_field(const hal::Vector3& centre_mm, double compliance, StructuralFit& result) const {
  const hal::Vector3 shift = (centre_mm - kOriginMm) * (1.0 / kScaleMm);
  constexpr std::array<std::array<Index, 3>, 3> kSecond{{{4, 7, 8}, {7, 5, 9}, {8, 9, 6}}};
  constexpr std::array kAxes{"x", "y", "z"};
  std::array<double, 3> gradient{};
  for (std::size_t i = 0; i < 3 && order_ >= 1; ++i) {
    Vector direction = Vector::Zero(count_);
    direction(static_cast<Index>(i) + 1) = 1.0;
    if (order_ == 2) {
      for (std::size_t j = 0; j < 3; ++j) direction(kSecond[i][j]) += 2.0 * component(shift, j);
    }
    gradient[i] = direction.dot(theta_) / (compliance * kScaleMm);
    result.parameters.push_back({std::string("gradient_") + kAxes[i] + "_per_mm", "1/mm", gradient[i],
                                 std::sqrt(variance_of(direction)) / (compliance * kScaleMm)});
  }
  result.model.gradient_per_mm = {gradient[0], gradient[1], gradient[2]};
  if (order_ < 2) return;
  constexpr std::array kNames{"xx", "yy", "zz", "xy", "xz", "yz"};
  for (std::size_t i = 0; i < 6; ++i) {
    const auto at = static_cast<Index>(i) + 4;
    Vector direction = Vector::Zero(count_);
    direction(at) = 1.0;
    result.model.curvature_per_mm2[i] = theta_(at) / (compliance * kScaleMm * kScaleMm);
    result.parameters.push_back({std::string("curvature_") + kNames[i] + "_per_mm2", "1/mm²",
                                 result.model.curvature_per_mm2[i],
                                 std::sqrt(variance_of(direction)) / (compliance * kScaleMm * kScaleMm)});
  }
}

/// Scatter of single presses about what they have in common.
double OrderFit::spread(double compliance) const {
  double differ = 0.0, weight = 0.0;
  for (std::size_t p = 0; p < presses_.size(); ++p) {
    if (!kept_[p]) continue;
    const Matrix& products = presses_[p].products;
    double forced = 0.0;
    for (Index i = 0; i < count_; ++i) forced -= theta_(i) * products(column(i), 0);
    forced += products(0, kDeflection);
    if (!(products(0, 0) > 0.0)) continue;
    const double relative = forced / products(0, 0) / compliance;
    differ += relative * relative;
    weight += 1.0;
  }
  return weight > 0.0 ? std::sqrt(differ / weight) : 0.0;
}

}  // namespace

void StructuralSums::add(const StructuralRow& row) noexcept {
  const std::array<double, 10> field = polynomial(row.place_mm);
  std::array<double, kRegressors + 1> entry{};
  for (std::size_t j = 0; j < 10; ++j) entry[j] = -row.force_n * field[j];
  entry[10] = std::copysign(kFrictionUnit, row.speed_mm_per_s);
  entry[11] = kDelayUnit * row.force_rate_n_per_s;
  entry[12] = row.deflection_mm;
  for (std::size_t i = 0; i <= kRegressors; ++i) {
    sum[i] += entry[i];
    for (std::size_t j = 0; j <= i; ++j) product[packed(i, j)] += entry[i] * entry[j];
  }
  rows += 1.0;
}

StructuralFit fit_structural(const std::vector<const StructuralPress*>& presses, int highest_order,
                             double rate_hz) {
  StructuralFit none;
  if (presses.empty()) return none;
  std::vector<CentredPress> within;
  hal::Vector3 from = presses.front()->place_mm, to = from;
  for (const StructuralPress* press : presses) {
    within.push_back(centred(*press));
    const hal::Vector3& place = press->place_mm;
    from = {std::min(from.x, place.x), std::min(from.y, place.y), std::min(from.z, place.z)};
    to = {std::max(to.x, place.x), std::max(to.y, place.y), std::max(to.z, place.z)};
  }
  for (int order = highest_order; order >= 0; --order) {
    if (static_cast<int>(presses.size()) < columns_of_order(order)) continue;
    OrderFit fit(within, order);
    if (!fit.solve()) continue;
    fit.judge(rate_hz);
    StructuralFit result;
    if (!fit.unpack((from + to) * 0.5, result)) continue;
    result.model.covered_from_mm = from;
    result.model.covered_to_mm = to;
    return result;
  }
  return none;
}

}  // namespace hapticd::identification
