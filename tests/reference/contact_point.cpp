#include "tests/reference/contact_point.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "server/identification/estimate/contact/contact_sandwich.h"
#include "server/identification/estimate/contact/contact_variable_projection.h"

namespace hapticd::identification {

double ApproachDetector::noise_n() const noexcept {
  return std::sqrt(variance_n2_);
}

bool ApproachDetector::update(const ApproachSample& sample) noexcept {
  if (!std::isfinite(sample.force_n) || !std::isfinite(sample.time_s)) return false;
  if (!started_) {
    started_ = true;
    first_s_ = last_s_ = sample.time_s;
    mean_n_ = quick_mean_n_ = sample.force_n;
    return false;
  }
  const double step_s = std::max(0.0, sample.time_s - last_s_);
  last_s_ = sample.time_s;
  const double off_n = sample.force_n - mean_n_;
  const double min_n = std::max(threshold_n_, kDeviations * noise_n());
  const bool above = std::abs(off_n) > min_n;
  above_ = above ? above_ + 1 : 0;
  below_ = std::abs(off_n) > 0.5 * min_n ? 0 : below_ + 1;
  if (in_contact_) {
    if (below_ >= kOnEnd) in_contact_ = false;
    return false;
  }
  // A young mean learns as fast as there are samples.
  const double known_s = std::min(memory_s_, sample.time_s - first_s_);
  if (!above) {
    constexpr double kQuick = 40.0;
    const double share = 1.0 - std::exp(-step_s / std::max(step_s, known_s));
    mean_n_ += share * off_n;
    const double quick_off_n = sample.force_n - quick_mean_n_;
    quick_mean_n_ += (1.0 - std::exp(-kQuick * step_s / std::max(step_s, known_s))) * quick_off_n;
    variance_n2_ += share * (quick_off_n * quick_off_n - variance_n2_);
  }
  if (above_ < kOnEnd || sample.time_s - first_s_ < memory_s_) return false;
  in_contact_ = true;
  below_ = 0;
  ++contacts_;
  return true;
}

namespace {

/// f_0 and K for a given contact point and power, and what they leave.
struct Rise {
  double floor_n = 0.0, stiffness = 0.0;
  double squared_n2 = std::numeric_limits<double>::infinity();
};

Rise rise_from(std::span<const ApproachSample> samples, double from_mm, double power) {
  double n = 0.0, g1 = 0.0, f1 = 0.0, gg = 0.0, gf = 0.0, ff = 0.0;
  for (const ApproachSample& s : samples) {
    const double g = s.depth_mm > from_mm ? std::pow(s.depth_mm - from_mm, power) : 0.0;
    n += 1.0;
    g1 += g;
    f1 += s.force_n;
    gg += g * g;
    gf += g * s.force_n;
    ff += s.force_n * s.force_n;
  }
  Rise rise;
  const double sgg = gg - g1 * g1 / n;
  if (!(sgg > 0.0)) return rise;
  rise.stiffness = (gf - g1 * f1 / n) / sgg;
  rise.floor_n = (f1 - rise.stiffness * g1) / n;
  rise.squared_n2 = ff - f1 * f1 / n - rise.stiffness * rise.stiffness * sgg;
  return rise;
}

double search(std::span<const ApproachSample> samples, double from_mm, double to_mm, double power) {
  return search_minimum(from_mm, to_mm, 40, 1e-4 * (to_mm - from_mm),
                        [&](double at) { return rise_from(samples, at, power).squared_n2; });
}

}  // namespace

std::optional<ContactPoint> find_contact_point(std::span<const ApproachSample> approach,
                                               std::size_t declared) {
  if (declared >= approach.size()) return std::nullopt;
  // As much free approach as there is loading, and at least a few samples of both.
  double free_n = 0.0;
  const std::size_t before = std::min<std::size_t>(declared, 200);
  for (std::size_t i = declared - before; i < declared; ++i) free_n += approach[i].force_n;
  free_n /= static_cast<double>(std::max<std::size_t>(1, before));
  const double at_declaration_n = approach[declared].force_n - free_n;
  std::size_t last = declared;
  while (last + 1 < approach.size() && approach[last].force_n - free_n < 8.0 * at_declaration_n &&
         approach[last].force_n - free_n > 0.3 * at_declaration_n) {
    ++last;
  }
  const std::size_t loading = std::max<std::size_t>(20, last - declared);
  const std::size_t first = declared - std::min(declared, 3 * loading);
  const std::span<const ApproachSample> around = approach.subspan(first, last - first + 1);
  if (around.size() < 20) return std::nullopt;
  const double from_mm = around.front().depth_mm;
  const double to_mm = around.back().depth_mm;
  if (!(to_mm > from_mm)) return std::nullopt;

  constexpr double kHertz = 1.5;
  ContactPoint point;
  point.depth_mm = search(around, from_mm, to_mm, kHertz);
  const Rise rise = rise_from(around, point.depth_mm, kHertz);
  if (!(rise.stiffness > 0.0)) return std::nullopt;
  point.model_error_mm =
      0.5 * std::abs(search(around, from_mm, to_mm, 1.0) - search(around, from_mm, to_mm, 2.0));

  SandwichCovariance<3> sandwich(3, around.size());
  SandwichCovariance<3>::Vector jacobian(3);
  for (const ApproachSample& s : around) {
    const double in_mm = std::max(0.0, s.depth_mm - point.depth_mm);
    const double g = std::pow(in_mm, kHertz);
    jacobian << 1.0, g, -kHertz * rise.stiffness * std::sqrt(in_mm);
    sandwich.add(jacobian, s.force_n - rise.floor_n - rise.stiffness * g);
  }
  const double own_mm = std::sqrt(std::max(0.0, sandwich.covariance()(2, 2)));
  point.standard_error_mm = std::hypot(own_mm, point.model_error_mm);
  const auto beyond = std::find_if(approach.begin() + static_cast<std::ptrdiff_t>(first), approach.end(),
                                   [&](const ApproachSample& s) { return s.depth_mm > point.depth_mm; });
  point.sample = static_cast<std::size_t>(beyond - approach.begin());
  return point;
}

}  // namespace hapticd::identification
