#pragma once

#include <optional>
#include <string>
#include <vector>

#include "hal/sim/device/device_model.h"
#include "rt/scene/scene_spec.h"

namespace hapticd::study {

/// One tap on an object as it is; what the grip feels is read off the truth.
struct TransientTrial {
  std::string device = "phantom_1_0";
  std::string object = "sponge_block";
  std::optional<rt::TransientParameters> transient{};
  std::optional<rt::TargetLaw> target{};  ///< none: the object as it is
  double rate_hz = 5000.0;
  double speed_mm_per_s = 200.0;
};

/// Log of each tick, from 20 ms before the true contact to 150 ms after it.
struct TapLog {
  double rate_hz = 0.0;
  std::size_t contact = 0;                    ///< index of the first tick in true contact
  std::vector<double> acceleration_m_per_s2;  ///< of the tip, vertical
  std::vector<double> hand_n;                 ///< on the hand, up
  std::vector<double> given_n;                ///< of object and motors together, up
  std::vector<double> transient_n;            ///< in the command
  double impact_mm_per_s = 0.0;               ///< true
  double amplitude_share = 0.0;
  double estimated_mm_per_s = 0.0;
  std::string failed;

  /// Time from true contact to the first force of the transient in the command; negative: there was none.
  double onset_ms() const;
  /// Largest rise of a force within 20 ms over the speed of the impact.
  double rate_hardness_n_per_mm(const std::vector<double>& force_n) const;
};
TapLog tap(const TransientTrial& trial);

struct DecayFit {
  double frequency_hz = 0.0;
  double decay_per_s = 0.0;
  double amplitude = 0.0;  ///< largest of what was fitted
  double residual = 1.0;   ///< rms over the rms of what was fitted
};
/// The decaying sinusoid that fits `values` best, `rate_hz` apart, near `about`.
DecayFit fit_decay(const std::vector<double>& values, double rate_hz, const rt::TransientMode& about);

/// What the transient added to the acceleration of the grip: the difference of two taps that are alike. From
/// where its smooth beginning is over to 80 ms.
DecayFit fit_added(const TapLog& with, const TapLog& without, const rt::TransientMode& mode);

}  // namespace hapticd::study
