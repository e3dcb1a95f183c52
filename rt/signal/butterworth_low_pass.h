#pragma once

#include <cmath>
#include <cstddef>
#include <numbers>

#include "hal/samples.h"

namespace hapticd::rt {

/// Second-order Butterworth low-pass, y" = ω² (u - y) - √2 ω y', by the trapezoidal rule over the measured
/// interval between two inputs. At the nominal interval that is the bilinear transform with the cut-off
/// prewarped, so the gain at the cut-off is exactly 1/√2; at any other it is the same filter in time: second
/// order, stable for any interval, and a constant stays one. Gain 1 and group delay √2 / (2π cutoff) at low
/// frequency (4.5 ms at 50 Hz).
/// `Value` is one number, a vector of three, or several such parts(), which are filtered alike.
template <class Value>
class BasicButterworthLowPass {
 public:
  /// 0 < cutoff_hz < rate_hz / 2.
  BasicButterworthLowPass(double cutoff_hz, double rate_hz) noexcept
      : k_(std::tan(std::numbers::pi * cutoff_hz / rate_hz)), nominal_(over(1.0)), step_(nominal_) {}

  /// `periods`: of the loop since the last input, ≥ 0.
  const Value& update(const Value& input, double periods = 1.0) noexcept {
    if (periods != step_.periods) step_ = periods == 1.0 ? nominal_ : over(periods);
    // Part by part, so that hardly more is held at a time than there are registers.
    if constexpr (requires { input.parts(); }) {
      for (std::size_t i = 0; i < input.parts().size(); ++i) {
        advance(step_, input.parts()[i], input_.parts()[i], output_.parts()[i], slope_.parts()[i]);
      }
    } else {
      advance(step_, input, input_, output_, slope_);
    }
    return output_;
  }
  /// Settles at `value` as if it had been the input for ever: no start-up transient.
  void seed(const Value& value) noexcept {
    output_ = input_ = value;
    slope_ = Value{};
  }
  const Value& output() const noexcept { return output_; }
  static double low_frequency_delay_s(double cutoff_hz) noexcept {
    return std::numbers::sqrt2 / (2.0 * std::numbers::pi * cutoff_hz);
  }

 private:
  /// Step with h = periods T/2 and k = ω T/2: what of y' T/2 is kept over the interval, and what the input
  /// adds.
  struct Step {
    double periods;
    double keep;
    double take;
  };
  template <class Part>
  static void advance(const Step& step, const Part& input, Part& last_input, Part& output,
                      Part& slope) noexcept {
    const Part next = slope * step.keep + (input + last_input - output - output) * step.take;
    output = output + (slope + next) * step.periods;
    slope = next;
    last_input = input;
  }
  Step over(double periods) const noexcept {
    const double g = k_ * periods;
    const double scale = 1.0 / (1.0 + std::numbers::sqrt2 * g + g * g);
    return {periods, (1.0 - std::numbers::sqrt2 * g - g * g) * scale, k_ * g * scale};
  }

  double k_;
  Step nominal_;
  Step step_;  ///< of the last interval
  Value input_{};
  Value output_{};
  Value slope_{};  ///< y' T/2
};

using ButterworthLowPass = BasicButterworthLowPass<double>;
using ButterworthLowPass3 = BasicButterworthLowPass<hal::Vector3>;

}  // namespace hapticd::rt
