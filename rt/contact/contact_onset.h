#pragma once

#include <array>
#include <cstddef>

#include "rt/signal/vector.h"

namespace hapticd::rt {

/// Where a contact began. It is declared when the force is beyond doubt, a little after the tip touched;
/// meanwhile the tip went deeper, and taking the place of declaration for the surface would make every
/// displacement too small (0.1-0.3 mm on a soft object). So the recent past is kept, and searched for the
/// last tick at which the force was still nothing. `Place` is a depth along the press axis or a point.
template <class Place>
class BasicContactOnset {
 public:
  static constexpr std::size_t kMemory = 32;  ///< ticks

  void remember(const Place& place_mm, const Place& prompt_force_n) noexcept {
    newest_ = (newest_ + 1) % kMemory;
    ring_[newest_] = {place_mm, magnitude(prompt_force_n)};
    filled_ = filled_ < kMemory ? filled_ + 1 : kMemory;
  }
  void forget() noexcept { filled_ = 0; }
  /// The place at the latest remembered tick whose force was within `quiet_n`; the oldest remembered one if
  /// none was.
  Place place_mm(double quiet_n) const noexcept {
    Place place{};
    for (std::size_t age = 0; age < filled_; ++age) {
      const Moment& moment = ring_[(newest_ + kMemory - age) % kMemory];
      place = moment.place_mm;
      if (moment.force_n <= quiet_n) break;
    }
    return place;
  }

 private:
  struct Moment {
    Place place_mm{};
    double force_n = 0.0;
  };
  std::array<Moment, kMemory> ring_{};
  std::size_t newest_ = 0;
  std::size_t filled_ = 0;
};

using ContactOnset = BasicContactOnset<double>;
using ContactOnset3 = BasicContactOnset<hal::Vector3>;

}  // namespace hapticd::rt
