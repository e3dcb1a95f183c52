#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <utility>

#include "hal/samples.h"

namespace hapticd::rt {

/// Notices that the command oscillates by itself: it goes back and forth faster than a hand can make it, and
/// gives energy while it does.
///
/// A *reversal* is a turn of the command: it has come back by kSwingN from the farthest point it reached
/// since the last one. The sign of the command does not matter: held between 0 and the device's limit an
/// oscillation is as bad as one through zero. With E(t) the energy given to the tip, exact for forces held
/// over a tick,
///   E = Σ f(k-1) · (p(k) - p(k-1)),
/// an oscillation is
///   kReversals reversals within kWindowNs, and E over them ≥ kEnergyMj.
///
/// Why these: hands move back and forth up to 8 times a second, and a command that follows them reverses 16
/// times a second, eight times in half a second. Loops that are too stiff for device and hand oscillated at
/// 12 … 60 Hz in simulation: 24 and more reversals a second, twelve in half a second. Swings below 2 N buzz
/// and do not move a hand; noise in the command stays below 0.2 N. A stable loop is driven by the hand, which
/// pays for it; in one that oscillates by itself the device pays for what hand and object dissipate. Windows
/// are times, so the answer does not depend on the rate. Work and memory are bounded.
class OscillationMonitor {
 public:
  static constexpr double kSwingN = 3.0;
  static constexpr std::size_t kReversals = 12;
  static constexpr std::int64_t kWindowNs = 500'000'000;
  static constexpr double kEnergyMj = 0.2;

  /// Takes a force that was applied while the tip moved by `step_mm`, until `time_ns`. True: it oscillates;
  /// starts over then.
  bool update(const hal::Vector3& force_n, const hal::Vector3& step_mm, std::int64_t time_ns) noexcept {
    const bool is_nothing = dot(force_n, force_n) == 0.0;
    if (std::exchange(was_nothing_, is_nothing) && is_nothing)
      return false;  // as before: mostly so in free air
    energy_mj_ += dot(force_n, step_mm);
    const hal::Vector3 traced_n = force_n - turn_n_;
    const double traced_n2 = dot(traced_n, traced_n);
    if (traced_n2 >= reach_n2_) {
      farthest_n_ = force_n;
      reach_n2_ = traced_n2;
      return false;
    }
    const hal::Vector3 back_n = force_n - farthest_n_;
    const double back_n2 = dot(back_n, back_n);
    if (back_n2 < kSwingN * kSwingN || dot(back_n, farthest_n_ - turn_n_) >= 0.0) return false;
    turn_n_ = farthest_n_;
    farthest_n_ = force_n;
    reach_n2_ = back_n2;
    return note_reversal(time_ns);
  }
  void reset() noexcept { *this = {}; }

 private:
  struct Reversal {
    std::int64_t time_ns = 0;
    double energy_mj = 0.0;  ///< E at that time
  };

  bool note_reversal(std::int64_t time_ns) noexcept {
    // `next_` is the oldest of the last kReversals - 1: with this one they are kReversals.
    const Reversal oldest = reversals_[next_];
    const bool full = count_ == reversals_.size();
    reversals_[next_] = {time_ns, energy_mj_};
    next_ = (next_ + 1) % reversals_.size();
    if (!full) {
      ++count_;
      return false;
    }
    const bool fast = time_ns - oldest.time_ns <= kWindowNs;
    if (!fast || energy_mj_ - oldest.energy_mj < kEnergyMj) return false;
    reset();
    return true;
  }

  std::array<Reversal, kReversals - 1> reversals_{};
  std::size_t next_ = 0;
  std::size_t count_ = 0;
  hal::Vector3 turn_n_;      ///< where the command turned last
  hal::Vector3 farthest_n_;  ///< the farthest from there since
  double reach_n2_ = 0.0;    ///< its distance from there, squared
  double energy_mj_ = 0.0;
  bool was_nothing_ = false;  ///< the force before
};

}  // namespace hapticd::rt
