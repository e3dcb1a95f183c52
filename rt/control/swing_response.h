#pragma once

#include <algorithm>
#include <cmath>

namespace hapticd::rt {

/// Gives up compensations, step by step, while a contact along one axis swings. A structure may be softer or
/// slower than the device's data say, and the loop may be later than it knows: then the compensations take
/// the damping away that kept the loop still.
///
/// The signal is the reaction's lead (ReactionLead): it has no mean, and a hand is slower than its band. A
/// *turn* is a change of its sign with at least kSwingN in between. kTurns of them, each within kHalfSwingS
/// of the one before, are a swing, also if something shakes the object from outside. A scene without the lead
/// has no such signal. The swings take, one after the other:
///
/// 1. the lead; it is back with the next contact once it has been still for kStillS;
/// 2. half of the structure's compensation, and 3. the rest: the loop gain falls to 1 - k~/k_s of it
///    (desired_force_compensated()), and the object feels harder than the target;
/// 4. half of the controller's proportional gain, and 5. half of the rest: slower, the held force is the
/// same.
///
/// The structure's compensation and the gain are back with the next target: this one was too much for the
/// structure. Bounded work in each tick.
class SwingResponse {
 public:
  static constexpr double kSwingN = 0.05;
  static constexpr double kHalfSwingS = 0.06;
  static constexpr int kTurns = 12;
  static constexpr double kStillS = 2.0;
  static constexpr double kFadeS = 0.05;  ///< in which all of a share would go

  /// Takes the lead of a tick, N, and the time since the last one.
  void update(double lead_n, double interval_s) noexcept {
    since_turn_s_ += interval_s;
    peak_n_ = std::max(peak_n_, std::abs(lead_n));
    if ((lead_n < 0.0) != is_negative_) note_turn(lead_n);
    const double step = interval_s / kFadeS;
    structure_share_ += std::clamp(left_of_structure() - structure_share_, -step, step);
    gain_share_ += std::clamp(left_of_gain() - gain_share_, -step, step);
  }
  /// A contact begins.
  void begin() noexcept {
    if (since_turn_s_ > kStillS && keeps_structure()) swings_ = 0;
  }
  /// Another target is asked for.
  void retry() noexcept {
    if (!keeps_structure()) swings_ = 0;
  }
  /// Forgets the motion so far. What only the next target brings back stays given up.
  void reset() noexcept {
    turns_ = 0;
    if (keeps_structure()) swings_ = 0;
  }

  bool keeps_lead() const noexcept { return swings_ == 0; }
  bool keeps_structure() const noexcept { return swings_ < 2; }
  /// Part of the structure's compensation that acts, 0 … 1.
  double structure_share() const noexcept { return structure_share_; }
  /// Part of the proportional gain that acts, 0.25 … 1.
  double gain_share() const noexcept { return gain_share_; }

 private:
  double left_of_structure() const noexcept { return std::clamp(0.5 * (3 - swings_), 0.0, 1.0); }
  double left_of_gain() const noexcept { return swings_ < 4 ? 1.0 : swings_ < 5 ? 0.5 : 0.25; }

  void note_turn(double lead_n) noexcept {
    is_negative_ = lead_n < 0.0;
    if (peak_n_ < kSwingN) {  // noise: as if it had not turned
      peak_n_ = 0.0;
      return;
    }
    turns_ = since_turn_s_ < kHalfSwingS ? turns_ + 1 : 0;
    since_turn_s_ = peak_n_ = 0.0;
    if (turns_ < kTurns) return;
    turns_ = 0;
    swings_ = std::min(swings_ + 1, 5);
  }

  double peak_n_ = 0.0;        ///< of the lead since it turned
  double since_turn_s_ = 0.0;  ///< since it turned last with kSwingN before
  double structure_share_ = 1.0;
  double gain_share_ = 1.0;
  int turns_ = 0;
  int swings_ = 0;
  bool is_negative_ = false;
};

}  // namespace hapticd::rt
