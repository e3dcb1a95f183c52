#include "rt/modulation/transient_waveform.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <numbers>

namespace hapticd::rt {

namespace {

constexpr double kFasterOfOmega = 0.25;  // κ: faster costs much force, slower leaves little of the mode
constexpr double kFasterOfDecay = 2.5;
constexpr double kMPerMm = 1e-3;
constexpr double kMjPerJ = 1e3;

/// Largest a(t), to a thousandth.
double peak_of(const SmoothMode& mode) {
  constexpr int kStepsOfPeriod = 100;
  constexpr int kPeriods = 4;
  const double step_s = 2.0 * std::numbers::pi / (mode.pole[0].imag() * kStepsOfPeriod);
  double peak = 0.0;
  for (int i = 1; i <= kPeriods * kStepsOfPeriod; ++i) {
    std::complex<double> a;
    for (std::size_t j = 0; j < SmoothMode::kTerms; ++j)
      a += mode.weight[j] * std::exp(mode.pole[j] * (step_s * i));
    peak = std::max(peak, std::abs(a.imag()));
  }
  return peak;
}

}  // namespace

SmoothMode smooth_mode(double frequency_hz, double decay_per_s) {
  constexpr int kUnknown = SmoothMode::kTerms - 1;
  const double omega = 2.0 * std::numbers::pi * frequency_hz;
  const double faster_per_s = std::max(kFasterOfOmega * omega, kFasterOfDecay * decay_per_s);
  SmoothMode mode;
  for (std::size_t j = 0; j < SmoothMode::kTerms; ++j) {
    mode.pole[j] = {-decay_per_s - static_cast<double>(j) * faster_per_s, omega};
  }
  Eigen::Matrix<std::complex<double>, kUnknown, kUnknown> a;
  Eigen::Matrix<std::complex<double>, kUnknown, 1> b;
  for (int m = 0; m < kUnknown; ++m) {
    b(m) = -1.0;  // over the mode's own power, so that rows are of like size
    for (int j = 0; j < kUnknown; ++j) {
      a(m, j) = std::pow(mode.pole[static_cast<std::size_t>(j + 1)] / mode.pole[0], m - 2);
    }
  }
  const Eigen::Matrix<std::complex<double>, kUnknown, 1> x = a.fullPivLu().solve(b);
  mode.weight[0] = 1.0;
  for (int j = 0; j < kUnknown; ++j) mode.weight[static_cast<std::size_t>(j + 1)] = x(j);
  const double peak = peak_of(mode);
  for (auto& weight : mode.weight) weight /= peak;
  return mode;
}

TransientWaveform::TransientWaveform(const TransientParameters& transient, const GripPlant& plant,
                                     double rate_hz)
    : end_tick_(static_cast<std::uint32_t>(std::lround(kDurationS * rate_hz))),
      fade_tick_(static_cast<std::uint32_t>(std::lround((kDurationS - kFadeOutS) * rate_hz))) {
  for (const TransientMode& mode : transient.target) add(mode, 1.0, plant, 1.0 / rate_hz);
  for (const TransientMode& mode : transient.real) add(mode, -1.0, plant, 1.0 / rate_hz);
  for (std::size_t power = 1; power < kPowers; ++power) {
    for (std::size_t i = 0; i < count_; ++i) step_[power][i] = step_[power - 1][i] * step_[power - 1][i];
  }
  measure(1.0 / rate_hz);
  tick_ = end_tick_;
}

void TransientWaveform::add(const TransientMode& mode, double sign, const GripPlant& plant, double period_s) {
  if (count_ + kTermsOfMode > kMaxTerms) return;
  const SmoothMode smooth = smooth_mode(mode.frequency_hz, mode.decay_per_s);
  // A command that is held over a tick gives this share of the mode, half a tick late. The same for all
  // terms: else they would not add up to nothing at the beginning.
  const Complex half = 0.5 * period_s * smooth.pole[0];
  const double held = std::abs(std::sinh(half) / half);
  for (std::size_t j = 0; j < kTermsOfMode; ++j) {
    const Complex s = smooth.pole[j];
    const Complex acceleration = sign * mode.gain_per_s * kMPerMm * smooth.weight[j];
    weight_[count_] = acceleration * command_per_acceleration(plant, s) / held;
    velocity_[count_] = acceleration * motor_velocity_per_acceleration(plant, s) / weight_[count_];
    step_[0][count_] = std::exp(s * period_s);
    ++count_;
  }
}

void TransientWaveform::measure(double period_s) {
  double before_n = 0.0, energy_j = 0.0;
  restart();
  while (!is_over()) {
    const double now_n = force_n();
    double velocity_m_per_s = 0.0;
    for (std::size_t i = 0; i < count_; ++i) velocity_m_per_s += (now_[i] * velocity_[i]).imag();
    energy_j += now_n * velocity_m_per_s * period_s;
    peak_force_n_ = std::max(peak_force_n_, std::abs(now_n));
    peak_change_n_ = std::max(peak_change_n_, std::abs(now_n - before_n));
    peak_energy_mj_ = std::max(peak_energy_mj_, kMjPerJ * energy_j);
    before_n = now_n;
    advance(1);
  }
}

void TransientWaveform::restart() noexcept {
  tick_ = 0;
  now_ = weight_;
}

void TransientWaveform::advance(std::uint32_t ticks) noexcept {
  constexpr std::uint32_t kFarthest = (1U << kPowers) - 1;
  if (ticks > kFarthest || tick_ + ticks >= end_tick_) {
    tick_ = end_tick_;
    return;
  }
  for (std::size_t power = 0; power < kPowers; ++power) {
    if ((ticks >> power & 1U) == 0) continue;
    for (std::size_t i = 0; i < count_; ++i) {
      const Complex z = now_[i], s = step_[power][i];  // without the library's care for infinities
      now_[i] = {z.real() * s.real() - z.imag() * s.imag(), z.real() * s.imag() + z.imag() * s.real()};
    }
  }
  tick_ += ticks;
}

double TransientWaveform::force_n() const noexcept {
  if (is_over()) return 0.0;
  double force = 0.0;
  for (std::size_t i = 0; i < count_; ++i) force += now_[i].imag();
  if (tick_ <= fade_tick_) return force;
  return force * static_cast<double>(end_tick_ - tick_) / static_cast<double>(end_tick_ - fade_tick_);
}

}  // namespace hapticd::rt
