#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "rt/signal/vector.h"

namespace hapticd::rt {

namespace stiffness_fit {
inline double inner(double a, double b) noexcept {
  return a * b;
}
inline double inner(const hal::Vector3& a, const hal::Vector3& b) noexcept {
  return dot(a, b);
}
constexpr double components(double) noexcept {
  return 1.0;
}
constexpr double components(const hal::Vector3&) noexcept {
  return 3.0;
}
}  // namespace stiffness_fit

/// Regresses a reaction on displacement and acceleration by least squares, sample by sample:
///
///   f = b + k x + c a
///
/// b takes what is constant: the sensor's zero, the weight of a tilted tool. c takes what the tool's mass is
/// told wrong by. So k is left to what only an object has: a reaction that grows with the way into it.
/// `Value` is a number along that way or a vector in the rig frame, with one k for all directions.
///
/// The samples of a filtered reading are not independent, so the standard error is that of a tenth as many.
/// Ten running sums, exact to rounding; nothing grows but the sums.
template <class Value>
class BasicStiffnessFit {
 public:
  static constexpr std::uint32_t kMinSamples = 6;

  void reset() noexcept { *this = {}; }

  /// `force_n` grows with `x_mm`, the way into an object.
  void add(const Value& force_n, const Value& x_mm, const Value& acceleration_mm_per_s2) noexcept {
    using stiffness_fit::inner;
    if (count_ == 0) {
      first_force_n_ = force_n;
      first_x_mm_ = x_mm;
    }
    const Value f = force_n - first_force_n_;
    const Value x = x_mm - first_x_mm_;
    const Value& a = acceleration_mm_per_s2;
    ++count_;
    f_ = f_ + f;
    x_ = x_ + x;
    a_ = a_ + a;
    ff_ += inner(f, f);
    xx_ += inner(x, x);
    aa_ += inner(a, a);
    xf_ += inner(x, f);
    af_ += inner(a, f);
    xa_ += inner(x, a);
    extent_mm_ = std::max(extent_mm_, magnitude(x));
  }

  /// True if the reaction has grown with the way by `grown_n`, and by more than `lowest_n_per_mm` beyond
  /// three standard errors. `noise_n`: standard deviation of the reading at least; what the line leaves
  /// unexplained counts if it is more.
  bool shows_object(double noise_n, double lowest_n_per_mm, double grown_n) const noexcept {
    using stiffness_fit::inner;
    if (count_ < kMinSamples || !(extent_mm_ > 0.0)) return false;
    const double n = count_;
    const double all = n * stiffness_fit::components(Value{});
    const double xa = xa_ - inner(x_, a_) / n;
    const double aa = aa_ - inner(a_, a_) / n;
    const double af = af_ - inner(a_, f_) / n;
    const double by_mass = aa > kLeastVariance * aa_ ? 1.0 / aa : 0.0;
    const double xx = xx_ - inner(x_, x_) / n - xa * xa * by_mass;
    const double xf = xf_ - inner(x_, f_) / n - xa * af * by_mass;
    if (!(xx > kLeastVariance * xx_)) return false;
    const double k = xf / xx;
    if (!(k > lowest_n_per_mm) || !(k * extent_mm_ > grown_n)) return false;
    const double left = std::max(0.0, ff_ - inner(f_, f_) / n - af * af * by_mass - k * xf);
    const double variance = kSamplesPerIndependent * std::max(noise_n * noise_n, left / all);
    const double beyond = k - lowest_n_per_mm;
    return beyond * beyond * xx > 9.0 * variance;
  }

 private:
  static constexpr double kSamplesPerIndependent = 10.0;
  static constexpr double kLeastVariance = 1e-9;  // below it a difference of sums is rounding

  std::uint32_t count_ = 0;
  Value first_force_n_{};
  Value first_x_mm_{};
  Value f_{};
  Value x_{};
  Value a_{};
  double ff_ = 0.0;
  double xx_ = 0.0;
  double aa_ = 0.0;
  double xf_ = 0.0;
  double af_ = 0.0;
  double xa_ = 0.0;
  double extent_mm_ = 0.0;
};

using StiffnessFit = BasicStiffnessFit<double>;
using StiffnessFit3 = BasicStiffnessFit<hal::Vector3>;

}  // namespace hapticd::rt
