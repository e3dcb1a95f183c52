#pragma once

#include <array>
#include <cstddef>

namespace hapticd::rt {

/// Where a contact began. It is declared when the force is beyond doubt, a little after the tip touched;
/// meanwhile the tip went deeper, and taking the place of declaration for the surface would make every
/// displacement too small (0.1-0.3 mm on a soft object). So the recent past is kept, and searched for the
/// last tick at which the force was still nothing.
class ContactOnset {
 public:
  static constexpr std::size_t kMemory = 32;  ///< ticks

  void remember(double depth_mm, double prompt_force_n) noexcept;
  void forget() noexcept { filled_ = 0; }
  /// Depth at the latest remembered tick whose force was within `quiet_n`; the oldest remembered one if none
  /// was.
  double depth_mm(double quiet_n) const noexcept;

 private:
  struct Moment {
    double depth_mm = 0.0;
    double force_n = 0.0;
  };
  std::array<Moment, kMemory> ring_{};
  std::size_t newest_ = 0;
  std::size_t filled_ = 0;
};

}  // namespace hapticd::rt
