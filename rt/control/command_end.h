#pragma once

#include <algorithm>

#include "rt/signal/tick_interval.h"
#include "rt/signal/vector.h"

namespace hapticd::rt {

/// Ends what is commanded within a fixed time after the contact, whatever the controller's gains make of a
/// desired force that has gone: from kFromS on the magnitude is bounded by a line that comes down from the
/// device's force to zero at kUntilS. The bound passes on to the controller with what is applied, so its
/// state is zero by then, too. In contact nothing is changed; a controller of the published gains is done
/// before the line.
template <class Value>
class BasicCommandEnd {
 public:
  static constexpr double kFromS = 0.008;
  static constexpr double kUntilS = 0.020;

  explicit BasicCommandEnd(double max_force_n) noexcept : max_force_n_(max_force_n) {}

  Value update(bool in_contact, const Value& command_n, const TickInterval& interval) noexcept {
    if (in_contact) {
      since_s_ = 0.0;
      return command_n;
    }
    if (since_s_ >= kUntilS) return Value{};
    since_s_ += interval.s;
    const double bound_n = max_force_n_ * (kUntilS - since_s_) / (kUntilS - kFromS);
    const double size_n = magnitude(command_n);
    if (!(size_n > bound_n)) return command_n;
    return bound_n > 0.0 ? command_n * (bound_n / size_n) : Value{};
  }
  void reset() noexcept { since_s_ = kUntilS; }

 private:
  double max_force_n_;
  double since_s_ = kUntilS;
};

using CommandEnd = BasicCommandEnd<double>;
using CommandEnd3 = BasicCommandEnd<hal::Vector3>;

}  // namespace hapticd::rt
