#pragma once

namespace hapticd::rt {

/// Takes the desired force to zero over 50 ms when a contact ends. An object that recovers slowly lets go of
/// the tip while it is still deep: the target's force there, k~ x, is newtons, and dropping it at once would
/// be felt as a knock.
class ReleaseFade {
 public:
  static constexpr double kDurationS = 0.05;

  explicit ReleaseFade(double rate_hz) noexcept : step_(1.0 / (kDurationS * rate_hz)) {}

  /// In contact, passes `desired_force_n` on and remembers it; afterwards fades out from the last one,
  /// linearly.
  double update(bool in_contact, double desired_force_n) noexcept {
    if (in_contact) {
      last_force_n_ = desired_force_n;
      share_ = 1.0;
      return desired_force_n;
    }
    share_ = share_ > step_ ? share_ - step_ : 0.0;
    return share_ * last_force_n_;
  }
  void reset() noexcept { share_ = 0.0; }

 private:
  double step_;
  double share_ = 0.0;
  double last_force_n_ = 0.0;
};

}  // namespace hapticd::rt
