#include "hal/sim/object/general_material.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "hal/sim/object/monotone_root.h"

namespace hapticd::sim {

namespace {

constexpr double kFastestS = 2e-4;
constexpr double kTimeRatio = 3.1622776601683795;  // two modes a decade
constexpr double kLogRatio = 0.5 * std::numbers::ln10;

double mode_time_s(std::size_t i) noexcept {
  return kFastestS * std::pow(kTimeRatio, static_cast<double>(i));
}

/// t^-p = 1/Γ(p) ∫ τ^-p exp(-t/τ) d ln τ, by equal steps of ln τ.
double mode_stiffness(double power, std::size_t i) noexcept {
  return kLogRatio * std::pow(mode_time_s(i), -power) / std::tgamma(power);
}

/// Integral beyond the slowest mode's share of it, as long as nothing has faded yet.
double beyond_the_slowest(double power) noexcept {
  const double from_s = mode_time_s(GeneralMaterial::kModes - 1) * std::sqrt(kTimeRatio);
  return std::pow(from_s, -power) / (power * std::tgamma(power));
}

/// A number too small to matter becomes zero: the processor is slow at the smallest ones.
double flushed(double value) noexcept {
  return std::abs(value) < 1e-150 ? 0.0 : value;
}

/// Share of the end in the middle of a step that counts: ½ is of second order, more does not ring.
double theta(double step_over_time) noexcept {
  return step_over_time <= 2.0 ? 0.5 : 1.0 - 1.0 / step_over_time;
}

}  // namespace

GeneralMaterial::GeneralMaterial(const MaterialParameters& shape, const GeneralMaterialParameters& memory,
                                 double step_s)
    : shape_(shape), memory_(memory), step_s_(step_s) {
  depth_at_4n_mm_ = 4.0 / shape.stiffness_at_4n_n_per_mm;
  strain_norm_ = std::sqrt((1.0 + 0.5 * memory.strain_growth) * (1.0 + memory.strain_growth));
  never_fades_ = memory.fading_share * beyond_the_slowest(memory.power);
  for (std::size_t i = 0; i < kModes; ++i) {
    stiffness_[i] = memory.fading_share * mode_stiffness(memory.power, i);
    step_over_time_[i] = step_s / mode_time_s(i);
  }
  load_to_4n();
}

// The depth after a ramp to 4 N falls smoothly as the scale grows: a few secant steps in logarithms. The ramp
// is slow, so steps of 10 ms resolve it; the trial objects are this one with another step.
void GeneralMaterial::load_to_4n() {
  constexpr double kRampS = 8.0, kRampStepS = 0.01;
  const auto log_depth = [&](double scale_n) {
    GeneralMaterial trial = *this;
    trial.scale_n_ = scale_n;
    trial.step_s_ = kRampStepS;
    for (std::size_t i = 0; i < kModes; ++i) trial.step_over_time_[i] = kRampStepS / mode_time_s(i);
    constexpr double kComplianceMmPerN = 1e5;
    const int steps = static_cast<int>(std::lround(kRampS / kRampStepS));
    double depth_mm = 0.0;
    for (int i = 0; i < steps; ++i) {
      const double force_n = 4.0 * (i + 0.5) / steps;
      depth_mm = trial.advance(depth_mm + kComplianceMmPerN * force_n, kComplianceMmPerN).depth_mm;
    }
    return std::log(depth_mm / depth_at_4n_mm_);
  };
  double log_scale = std::log(4.0);
  double value = log_depth(std::exp(log_scale));
  double next = log_scale + value;
  for (int i = 0; i < 20 && std::abs(value) > 1e-7; ++i) {
    const double next_value = log_depth(std::exp(next));
    const double slope = (next_value - value) / (next - log_scale);
    log_scale = next;
    value = next_value;
    next = log_scale - std::clamp(value / slope, -1.0, 1.0);
  }
  scale_n_ = std::exp(log_scale);
}

double GeneralMaterial::strain(double u) const noexcept {
  return u * (1.0 + 0.5 * memory_.strain_growth * u) / strain_norm_;
}
double GeneralMaterial::strain_slope(double u) const noexcept {
  return (1.0 + memory_.strain_growth * u) / strain_norm_;
}
/// Change of strain over the change of u from where the step began; exact, for the strain is a polynomial.
double GeneralMaterial::mean_strain_slope(double to_u) const noexcept {
  const double from_u = depth_mm_ / depth_at_4n_mm_;
  return (1.0 + 0.5 * memory_.strain_growth * (from_u + to_u)) / strain_norm_;
}

double GeneralMaterial::settled(double u, double& slope) const noexcept {
  const MaterialParameters& p = shape_;
  const double width = 1.0 - p.densification_onset;
  const double dense = std::max(0.0, (u - p.densification_onset) / width);
  slope = p.linear + 2.0 * p.quadratic * u + 3.0 * p.densifying * dense * dense / width;
  return u * (p.linear + p.quadratic * u) + p.densifying * dense * dense * dense;
}

/// Work of the settled curve over the way it is done on, without the cancellation of a difference.
double GeneralMaterial::mean_settled(double to_u, double& slope) const noexcept {
  const MaterialParameters& p = shape_;
  const double from_u = depth_mm_ / depth_at_4n_mm_;
  const double width = 1.0 - p.densification_onset;
  const double from = (from_u - p.densification_onset) / width;
  const double to = (to_u - p.densification_onset) / width;
  double dense = 0.0, dense_slope = 0.0;
  if (from > 0.0 && to > 0.0) {
    dense = 0.25 * (from + to) * (from * from + to * to);
    dense_slope = 0.25 * (3.0 * to * to + 2.0 * from * to + from * from);
  } else if (to > 0.0) {
    const double way = to - from;
    dense = 0.25 * to * to * to * to / way;
    dense_slope = (to * to * to - dense) / way;
  } else if (from > 0.0) {
    const double way = from - to;
    dense = 0.25 * from * from * from * from / way;
    dense_slope = dense / way;
  }
  slope = 0.5 * p.linear + p.quadratic * (from_u + 2.0 * to_u) / 3.0 + p.densifying * dense_slope / width;
  return 0.5 * p.linear * (from_u + to_u) +
         p.quadratic * (from_u * from_u + from_u * to_u + to_u * to_u) / 3.0 + p.densifying * dense;
}

// The skin's energy is k d x² / (x + d): steep at first, then a constant force.
double GeneralMaterial::skin_n(double mm, double& slope) const noexcept {
  const double d = shape_.skin_depth_mm;
  const double at = mm + d;
  const double k = 0.5 * shape_.skin_stiffness_n_per_mm * d;
  slope = k * 2.0 * d * d / (at * at * at);
  return k * mm * (mm + 2.0 * d) / (at * at);
}
double GeneralMaterial::mean_skin_n(double to_mm, double& slope) const noexcept {
  const double d = shape_.skin_depth_mm;
  const double from = depth_mm_ + d, to = to_mm + d;
  const double k = 0.5 * shape_.skin_stiffness_n_per_mm * d;
  slope = k * d * d / (from * to * to);
  return k * (depth_mm_ * to_mm + d * (depth_mm_ + to_mm)) / (from * to);
}

double GeneralMaterial::viscosity(double depth_mm) const noexcept {
  return shape_.skin_viscosity_n_s_per_mm * depth_mm / (depth_mm + shape_.skin_depth_mm);
}

double GeneralMaterial::settled_force_n(double depth_mm) const noexcept {
  double slope = 0.0;
  const double u = depth_mm / depth_at_4n_mm_;
  return scale_n_ *
             ((1.0 - memory_.fading_share) * settled(u, slope) + never_fades_ * strain(u) * strain_slope(u)) +
         skin_n(depth_mm, slope);
}

double GeneralMaterial::stored_n_mm() const noexcept {
  const MaterialParameters& p = shape_;
  const double u = depth_mm_ / depth_at_4n_mm_;
  const double width = 1.0 - p.densification_onset;
  const double dense = std::max(0.0, (u - p.densification_onset) / width);
  double sum = (1.0 - memory_.fading_share) * (u * u * (0.5 * p.linear + p.quadratic * u / 3.0) +
                                               0.25 * p.densifying * width * dense * dense * dense * dense);
  sum += 0.5 * never_fades_ * strain_ * strain_;
  for (std::size_t i = 0; i < kModes; ++i) sum += 0.5 * stiffness_[i] * stretch_[i] * stretch_[i];
  sum += 0.5 * memory_.pore_share * pore_stretch_ * pore_stretch_;
  for (std::size_t i = 0; i < slip_stretch_.size(); ++i) {
    sum += 0.5 * memory_.slips[i].share * slip_stretch_[i] * slip_stretch_[i];
  }
  const double d = p.skin_depth_mm;
  return scale_n_ * depth_at_4n_mm_ * sum +
         0.5 * p.skin_stiffness_n_per_mm * d * depth_mm_ * depth_mm_ / (depth_mm_ + d);
}

/// Mean flow through the pores over the step: w = τ v (1 + |v|/v_f) at the weighted middle, solved.
double GeneralMaterial::pore_flow(double change) const noexcept {
  const double driven = pore_stretch_ + pore_weight_ * change;
  const double a = pore_time_s_ / memory_.pore_strain_rate_per_s;
  const double b = pore_time_s_ + pore_weight_ * step_s_;
  return 2.0 * driven / (b + std::sqrt(b * b + 4.0 * a * std::abs(driven)));
}

/// A slip element along a change of strain: stretched until its limit, then along it; exact work.
GeneralMaterial::Slipped GeneralMaterial::slip(const SlipShare& element, double spring, double from,
                                               double change) noexcept {
  const double up = change >= 0.0 ? 1.0 : -1.0;
  // limit · strain - |spring| closes at 1 - limit on the way in, at 1 + limit on the way out.
  const double to_limit = (element.limit * from - up * spring) / (1.0 - up * element.limit);
  const double way = std::abs(change);
  if (way <= to_limit || change == 0.0) return {spring + 0.5 * change, 0.5, spring + change};
  const double stuck = std::max(0.0, to_limit);
  const double at_limit = spring + up * stuck;
  const double end = up * element.limit * (from + change);
  const double share = stuck / way;
  return {0.5 * (spring + at_limit) * share + 0.5 * (at_limit + end) * (1.0 - share),
          0.5 * up * element.limit * (1.0 - share), end};
}

GeneralMaterial::Answer GeneralMaterial::mean_memory(double change) const noexcept {
  Answer all{modes_mean_.force + modes_mean_.slope * change, modes_mean_.slope};
  if (memory_.pore_share > 0.0) {
    const double flow = pore_flow(change);
    const double a = pore_time_s_ / memory_.pore_strain_rate_per_s;
    const double b = pore_time_s_ + pore_weight_ * step_s_;
    all.force +=
        memory_.pore_share * pore_time_s_ * flow * (1.0 + std::abs(flow) / memory_.pore_strain_rate_per_s);
    all.slope +=
        memory_.pore_share * pore_weight_ * (1.0 - pore_weight_ * step_s_ / (b + 2.0 * a * std::abs(flow)));
  }
  for (std::size_t i = 0; i < slip_stretch_.size(); ++i) {
    const Slipped one = slip(memory_.slips[i], slip_stretch_[i], strain_, change);
    all.force += memory_.slips[i].share * one.mean;
    all.slope += memory_.slips[i].share * one.slope;
  }
  return all;
}

GeneralMaterial::Answer GeneralMaterial::end_memory(double change) const noexcept {
  Answer all{modes_end_.force + modes_end_.slope * change, modes_end_.slope};
  if (memory_.pore_share > 0.0) {
    const double flow = pore_flow(change);
    const double a = pore_time_s_ / memory_.pore_strain_rate_per_s;
    const double b = pore_time_s_ + pore_weight_ * step_s_;
    all.force += memory_.pore_share * (pore_stretch_ + change - step_s_ * flow);
    all.slope += memory_.pore_share * (1.0 - pore_weight_ * step_s_ / (b + 2.0 * a * std::abs(flow)));
  }
  for (std::size_t i = 0; i < slip_stretch_.size(); ++i) {
    const Slipped one = slip(memory_.slips[i], slip_stretch_[i], strain_, change);
    all.force += memory_.slips[i].share * one.end;
    all.slope += memory_.slips[i].share * 2.0 * one.slope;
  }
  return all;
}

/// Work of all that is elastic over the path of the step, over that path.
GeneralMaterial::Answer GeneralMaterial::mean_force_n(double to_mm) const noexcept {
  const double u = to_mm / depth_at_4n_mm_;
  const double middle = mean_strain_slope(u);
  const double change = middle * (u - depth_mm_ / depth_at_4n_mm_);
  const Answer memory = mean_memory(change);
  double settled_slope = 0.0, skin_slope = 0.0;
  const double settled_share = 1.0 - memory_.fading_share;
  const double force = settled_share * mean_settled(u, settled_slope) + middle * memory.force;
  const double slope = settled_share * settled_slope +
                       0.5 * memory_.strain_growth / strain_norm_ * memory.force +
                       middle * memory.slope * strain_slope(u);
  const double skin = mean_skin_n(to_mm, skin_slope);
  return {scale_n_ * force + skin, scale_n_ * slope / depth_at_4n_mm_ + skin_slope};
}

GeneralMaterial::Answer GeneralMaterial::end_force_n(double to_mm) const noexcept {
  const double u = to_mm / depth_at_4n_mm_;
  const double change = mean_strain_slope(u) * (u - depth_mm_ / depth_at_4n_mm_);
  const Answer memory = end_memory(change);
  double settled_slope = 0.0, skin_slope = 0.0;
  const double settled_share = 1.0 - memory_.fading_share;
  const double force = settled_share * settled(u, settled_slope) + strain_slope(u) * memory.force;
  const double slope = settled_share * settled_slope + memory_.strain_growth / strain_norm_ * memory.force +
                       strain_slope(u) * memory.slope * strain_slope(u);
  const double skin = skin_n(to_mm, skin_slope);
  return {scale_n_ * force + skin, scale_n_ * slope / depth_at_4n_mm_ + skin_slope};
}

void GeneralMaterial::prepare_step() noexcept {
  // Times of the depth in the middle of the step, as far as it can be known beforehand.
  constexpr double kDensest = 2.0;
  const double u = std::clamp((depth_mm_ + 0.5 * last_change_mm_) / depth_at_4n_mm_, 0.0, kDensest);
  const double slower = 1.0 + (memory_.slower_when_dense - 1.0) * u * u;
  const double faster = 1.0 / slower;
  modes_mean_ = {never_fades_ * strain_, 0.5 * never_fades_};
  modes_end_ = {never_fades_ * strain_, never_fades_};
  for (std::size_t i = 0; i < kModes; ++i) {
    const double rate = step_over_time_[i] * faster;
    const double weight = theta(rate);
    const double taken_in = 1.0 / (1.0 + weight * rate);
    const double share = stiffness_[i] * taken_in;
    rate_[i] = rate * taken_in;
    weight_[i] = weight;
    modes_mean_.force += share * stretch_[i];
    modes_mean_.slope += share * weight;
    modes_end_.force += share * (1.0 - (1.0 - weight) * rate) * stretch_[i];
    modes_end_.slope += share;
  }
  pore_time_s_ = memory_.pore_time_s * slower;
  pore_weight_ = theta(step_s_ / pore_time_s_);
}

void GeneralMaterial::finish_step(double to_mm) noexcept {
  const double u = to_mm / depth_at_4n_mm_;
  const double change = mean_strain_slope(u) * (u - depth_mm_ / depth_at_4n_mm_);
  for (std::size_t i = 0; i < kModes; ++i) {
    const double middle = stretch_[i] + weight_[i] * change;
    stretch_[i] = flushed(stretch_[i] + change - rate_[i] * middle);
  }
  if (memory_.pore_share > 0.0) {
    pore_stretch_ = flushed(pore_stretch_ + change - step_s_ * pore_flow(change));
  }
  for (std::size_t i = 0; i < slip_stretch_.size(); ++i) {
    slip_stretch_[i] = slip(memory_.slips[i], slip_stretch_[i], strain_, change).end;
  }
  last_change_mm_ = to_mm - depth_mm_;
  depth_mm_ = to_mm;
  strain_ = strain(u);
}

GeneralMaterial::Step GeneralMaterial::advance(double free_depth_mm, double compliance_mm_per_n) noexcept {
  prepare_step();
  // A tip outside a flat surface, the usual case in free motion: only memory fades.
  if (free_depth_mm <= 0.0 && depth_mm_ <= 0.0) {
    finish_step(0.0);
    return {0.0, free_depth_mm, 0.0};
  }
  const double damping =
      viscosity(std::max(depth_mm_, 0.5 * (depth_mm_ + std::max(0.0, free_depth_mm)))) / step_s_;
  const auto mean_force = [&](double y) { return mean_force_n(y).force + damping * (y - depth_mm_); };

  Step step;
  double y = 0.0;
  const double largest_n = free_depth_mm > 0.0 ? mean_force(free_depth_mm) : 0.0;
  const bool touching = largest_n > 0.0;
  if (touching) {
    // y + compliance · mean force = free depth. Not deeper than free, for there the force is positive; a tip
    // that would be thrown out within the step is let go at the flat surface, for matter never pulls.
    double slope = 0.0;
    const auto beyond = [&](double at) {
      const Answer force = mean_force_n(at);
      slope = 1.0 + compliance_mm_per_n * (force.slope + damping);
      return at + compliance_mm_per_n * (force.force + damping * (at - depth_mm_)) - free_depth_mm;
    };
    const bool stays = compliance_mm_per_n * largest_n < free_depth_mm || beyond(0.0) < 0.0;
    if (stays) {
      y = monotone_root(
          beyond, [&](double) { return slope; }, depth_mm_ + last_change_mm_, 0.0, free_depth_mm);
      step.mean_force_n = std::max(0.0, mean_force(y));
    } else {
      step.mean_force_n = free_depth_mm / compliance_mm_per_n;
    }
    step.depth_mm = y;
  } else {
    // The tip moves on alone; the surface comes back as its own forces and viscosity let it, never past flat,
    // never through the tip.
    double slope = 0.0;
    const auto left_n = [&](double at) {
      const Answer force = end_force_n(at);
      slope = force.slope + damping;
      return force.force + damping * (at - depth_mm_);
    };
    if (depth_mm_ > 0.0 && left_n(0.0) < 0.0) {
      y = monotone_root(
          left_n, [&](double) { return slope; }, depth_mm_ + last_change_mm_, 0.0, depth_mm_);
    }
    y = std::max({0.0, y, free_depth_mm});
    step.depth_mm = free_depth_mm;
  }
  if (touching) {
    step.force_n = std::max(0.0, end_force_n(y).force + viscosity(y) * (y - depth_mm_) / step_s_);
  }
  finish_step(y);
  return step;
}

}  // namespace hapticd::sim
