#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

namespace hapticd::identification {

/// A sample of a slow approach to an object.
struct ApproachSample {
  double time_s = 0.0;
  double depth_mm = 0.0;  ///< grows towards the object
  double force_n = 0.0;
};

/// Declares contact on a recording whose sensor drifts: the force is compared with what it was a while ago
/// (an exponential mean that lags), and with its own noise about a quick mean, which no slow rise widens.
/// Declared when the force is off by the threshold and by six standard deviations for three samples on end.
class ApproachDetector {
 public:
  /// `memory_s`: of the baseline; what drifts more slowly is not a contact.
  ApproachDetector(double threshold_n, double memory_s = 2.0) noexcept
      : threshold_n_(threshold_n), memory_s_(memory_s) {}

  /// True at the sample with which contact is declared. Afterwards silent until the force is back within half
  /// of what it took; the baseline waits meanwhile.
  bool update(const ApproachSample& sample) noexcept;

  bool in_contact() const noexcept { return in_contact_; }
  std::uint32_t contacts() const noexcept { return contacts_; }
  double baseline_n() const noexcept { return mean_n_; }
  double noise_n() const noexcept;

 private:
  static constexpr int kOnEnd = 3;
  static constexpr double kDeviations = 6.0;

  double threshold_n_;
  double memory_s_;
  bool started_ = false;
  double first_s_ = 0.0, last_s_ = 0.0;
  double mean_n_ = 0.0, quick_mean_n_ = 0.0, variance_n2_ = 0.0;
  int above_ = 0, below_ = 0;
  bool in_contact_ = false;
  std::uint32_t contacts_ = 0;
};

/// Point at which an approach met the object.
struct ContactPoint {
  double depth_mm = 0.0;
  /// Error of its fit, and of not knowing by which power the force rises: half of what powers 1 and 2 differ.
  double standard_error_mm = 0.0;
  double model_error_mm = 0.0;
  std::size_t sample = 0;  ///< the first one beyond it
};

/// Contact point of the samples around a declared contact: f = f_0 + K max(0, x - x_c)^1.5, by least squares
/// (a sphere on a half-space, Hertz). `declared`: index of the declaration in `approach`; the samples after
/// it count until the force has grown to eight times what it was there. None if the force does not rise.
std::optional<ContactPoint> find_contact_point(std::span<const ApproachSample> approach,
                                               std::size_t declared);

}  // namespace hapticd::identification
