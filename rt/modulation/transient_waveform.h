#pragma once

#include <array>
#include <complex>
#include <cstddef>
#include <cstdint>

#include "rt/modulation/grip_inverse.h"

namespace hapticd::rt {

/// A decaying sinusoid that begins at rest.
///
/// A mode alone cannot begin at once: its acceleration jumps in slope, and the tip would have to have moved
/// before. So faster decaying terms of the same frequency are added, with weights that make displacement,
/// velocity, acceleration and its first three derivatives zero at the beginning:
///   a(t) = Im Σ_j c_j e^(p_j t),  p_j = s - j κ,  Σ_j c_j p_j^m = 0 for m = -2 … 3,
///   κ = max(0.25 ω, 2.5 B),  its largest acceleration 1.
struct SmoothMode {
  static constexpr std::size_t kTerms = 7;
  std::array<std::complex<double>, kTerms> pole{};
  std::array<std::complex<double>, kTerms> weight{};
};
SmoothMode smooth_mode(double frequency_hz, double decay_per_s);

/// The command that makes the grip accelerate as the transient says, for an impact of 1 mm/s.
///
/// Each term is an exponential, so the inverse of the dynamics is one complex factor: exact and stable
/// whatever poles and zeros the device has; no filter runs. The factor for a command that is held over a tick
/// is taken in too. Made when a scene is composed; the tick only multiplies.
class TransientWaveform {
 public:
  static constexpr double kDurationS = 0.1;
  static constexpr double kFadeOutS = 0.02;  ///< the last of it
  static constexpr std::size_t kTermsOfMode = SmoothMode::kTerms;
  static constexpr std::size_t kMaxTerms = 2 * TransientParameters::kMaxModes * kTermsOfMode;

  TransientWaveform(const TransientParameters& transient, const GripPlant& plant, double rate_hz);

  /// Begins again.
  void restart() noexcept;
  /// Goes on by `ticks`; beyond the end it stays there.
  void advance(std::uint32_t ticks) noexcept;
  bool is_over() const noexcept { return tick_ >= end_tick_; }
  /// Force for an impact of 1 mm/s, N, positive out of the object.
  double force_n() const noexcept;

  /// Peak force of an impact of 1 mm/s.
  double peak_force_n() const noexcept { return peak_force_n_; }
  double peak_change_n() const noexcept { return peak_change_n_; }  ///< within a tick
  /// Greatest energy that the motors have given at any time, mJ; grows with the square of the speed.
  double peak_energy_mj() const noexcept { return peak_energy_mj_; }

 private:
  using Complex = std::complex<double>;
  static constexpr std::size_t kPowers = 5;
  void add(const TransientMode& mode, double sign, const GripPlant& plant, double period_s);
  void measure(double period_s);

  std::size_t count_ = 0;
  std::array<Complex, kMaxTerms> weight_{};    ///< of the command, at the beginning
  std::array<Complex, kMaxTerms> velocity_{};  ///< of the motors over the command, for measure()
  std::array<Complex, kMaxTerms> now_{};
  std::array<std::array<Complex, kMaxTerms>, kPowers> step_{};  ///< over 1, 2, 4, 8, 16 ticks
  std::uint32_t tick_ = 0;
  std::uint32_t end_tick_;
  std::uint32_t fade_tick_;
  double peak_force_n_ = 0.0;
  double peak_change_n_ = 0.0;
  double peak_energy_mj_ = 0.0;
};

}  // namespace hapticd::rt
