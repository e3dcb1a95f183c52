#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>

#include "rt/record/onset_instant.h"
#include "rt/signal/ticks.h"
#include "rt/signal/vector.h"

namespace hapticd::rt {

/// Where a contact began. It is declared when the force is beyond doubt, a little after the tip touched;
/// meanwhile the tip went deeper, and taking the place of declaration for the surface would make every
/// displacement too small (0.1-0.3 mm on a soft object). So the recent past is kept, and searched for the
/// last tick at which the force was still nothing. `Place` is a depth along the press axis or a point.
///
/// The force is the mean of a time, FreeMotionResidual::prompt_force_n(), or noise of a single tick would
/// bring a late place within what is quiet. Its place is that in the middle of that time, and a little
/// before: of ticks that share most of their mean the last quiet one is quiet by chance. Where a mean is one
/// tick, both are of this tick.
template <class Place>
class BasicContactOnset {
 public:
  static constexpr double kMemoryS = 0.032;
  static constexpr double kForceAgeS = 0.6e-3;
  static constexpr std::size_t kMaxTicks = 320;  ///< kMemoryS at 10 kHz; a faster loop remembers less

  explicit BasicContactOnset(double rate_hz) noexcept
      : memory_(std::min<std::size_t>(ticks_of(kMemoryS, rate_hz), kMaxTicks)),
        force_age_(std::min(whole_ticks_in(kForceAgeS, rate_hz), memory_ - 1)) {}

  /// `force_ns`: the instant that the force stands for.
  void remember(const Place& place_mm, const Place& prompt_force_n, std::int64_t force_ns = 0) noexcept {
    newest_ = newest_ + 1 < memory_ ? newest_ + 1 : 0;
    ring_[newest_] = {place_mm, magnitude(prompt_force_n), force_ns};
    filled_ = std::min(filled_ + 1, memory_);
  }
  void forget() noexcept { filled_ = 0; }
  std::size_t memory_ticks() const noexcept { return memory_; }
  /// The place at the latest remembered tick whose force was within `quiet_n`; the oldest remembered one if
  /// none was.
  Place place_mm(double quiet_n) const noexcept {
    if (filled_ == 0) return Place{};
    const std::size_t oldest = filled_ - 1;
    std::size_t age = 0;
    while (age < oldest && !(before(age).force_n <= quiet_n)) ++age;
    return before(std::min(age + force_age_, oldest)).place_mm;
  }

  /// When the force began to leave what is quiet.
  OnsetInstant instant(double quiet_n) const noexcept {
    if (filled_ == 0) return {};
    const std::size_t oldest = filled_ - 1;
    std::size_t age = 0;
    while (age < oldest && !(before(age).force_n <= quiet_n)) ++age;
    const Moment& quiet = before(age);
    const Moment& loud = before(age > 0 ? age - 1 : 0);
    return {loud.force_ns, quiet.force_ns, loud.force_ns};
  }

 private:
  struct Moment {
    Place place_mm{};
    double force_n = 0.0;
    std::int64_t force_ns = 0;
  };
  const Moment& before(std::size_t age) const noexcept {
    return ring_[newest_ >= age ? newest_ - age : newest_ + memory_ - age];
  }

  std::size_t memory_;
  std::size_t force_age_;
  std::array<Moment, kMaxTicks> ring_{};
  std::size_t newest_ = 0;
  std::size_t filled_ = 0;
};

using ContactOnset = BasicContactOnset<double>;
using ContactOnset3 = BasicContactOnset<hal::Vector3>;

}  // namespace hapticd::rt
