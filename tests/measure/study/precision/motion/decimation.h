#pragma once

#include <cstddef>
#include <vector>

namespace hapticd::study {

enum class Decimation : unsigned char {
  kPicks,  ///< every n-th value, as the telemetry does
  kMeans,  ///< means of n values, reported at the middle of their time
};

/// What is lost of a signal of which only every n-th value is reported.
struct DecimationLoss {
  double rms_share = 0.0;         ///< rms of rebuilt less true, over rms of true
  double peak_share = 0.0;        ///< mean over bursts and phases of 1 - largest reported/largest
  double worst_peak_share = 0.0;  ///< the largest of these
};

/// Rebuilt on straight lines, and averaged over the n phases there are. A burst is where the signal is above
/// `burst_above`, up to a gap of 50 values.
DecimationLoss decimation_loss(const std::vector<double>& signal, std::size_t n, Decimation how,
                               double burst_above);

/// Share of a signal's power, its mean removed, at frequencies beyond `cycles_per_value` (0 … 0.5), by the
/// discrete Fourier transform of up to 4096 values from the middle under a Hann window.
double power_beyond(const std::vector<double>& signal, double cycles_per_value);

}  // namespace hapticd::study
