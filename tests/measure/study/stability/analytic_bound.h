#pragma once

namespace hapticd::study {

/// What delays the device force behind what it answers.
struct LoopDelays {
  double position_s = 0.0;  ///< τ_x: from the encoders to the tip
  double force_s = 0.0;     ///< τ_f: from the force on the sensor to the tip
};

/// τ_x = T/2 + T (1/Kp - 1) + τ_amp + τ_latency: half a period of holding, the lag of the controller
/// f_c(k) = (1 - Kp) f_c(k-1) + Kp f~_d(k) (none in open loop: Kp = 1), that of the amplifier, the latency.
/// τ_f = τ_x + 0.45 T: ten samples of the sensor are averaged over a period.
LoopDelays loop_delays(double rate_hz, double proportional_gain, double amplifier_pole_hz, double latency_s);

/// Largest stable target of a rigid hand mass on an object k, f_d = f_r(t - τ_f) - k~ x(t - τ_x): expanding
/// the delays to first order, the mass sees the damping b + τ_f k - τ_x k~, so k~_max ≈ (b + τ_f k)/τ_x.
/// N/mm. b is damping that the sensor does not feel, that of hand and device: the object's own is cancelled
/// with the rest of its force. The structure is taken as rigid, the detector as perfect.
double analytic_bound_n_per_mm(const LoopDelays& delays, double object_n_per_mm, double damping_n_s_per_mm);

}  // namespace hapticd::study
