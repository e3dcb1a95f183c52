#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <type_traits>

#include "hal/samples.h"
#include "rt/signal/butterworth_low_pass.h"
#include "rt/signal/instant_ring.h"
#include "rt/signal/number_pair.h"
#include "rt/signal/sliding_mean.h"

namespace hapticd::rt {

/// How much of the sensor's force the tool's own inertia cannot explain: the quantity contact is decided on.
///
/// (3.4) subtracts m a, with a filtered so that it can be used at all; the filter's delay leaves m j τ of
/// every free motion behind (j its jerk), several times the 15 mN threshold when the device is shaken at 1 N
/// and 5 Hz. Here force and inertia pass the same filter L, so that what remains of free motion is exactly
/// zero, and the force's lead over its own filtered value is added back as far as the motion's jerk does not
/// account for it:
///
///   r = L[f_s - m a_raw] + dead_zone(f_s - L[f_s]; γ m (j + j_0) τ)
///
/// A slow contact is seen through L, τ = 11 ms late; an impact rises above what jerk can do within a tick or
/// two. j_0 is the jerk with which a motion may begin before the encoders see it: without it every brisk
/// start would be taken for a contact.
///
/// Force and position are measured at different instants; r is taken at the latest instant both reach, by
/// their ages. An interval longer than the period is stepped through, the tip on a parabola and the force at
/// its mean. What that leaves uncertain is bounded by the jerk:
///
///   u = ½ m (j + j_0) (s - T) min(1, s/τ), s the interval, fading with τ as L forgets it
///
/// The bound widens the dead zone, and the threshold that r is compared with.
///
/// `Value` is one number (along a press axis) or a vector of three (rig frame, gravity subtracted).
template <class Value>
class BasicFreeMotionResidual {
 public:
  /// Time of which prompt_force_n() takes the sensor's force: what one tick brings at 1 kHz.
  static constexpr double kPromptMeanS = 1e-3;

  BasicFreeMotionResidual(double tool_mass_g, double rate_hz) noexcept;

  /// One tick's measurement.
  struct Measurement {
    /// Signed so that in free motion force = m · acceleration of `position_mm` (in 1D: pushed back is
    /// positive, and so is into the object).
    Value force_n{};
    Value position_mm{};
    std::int64_t position_ns = 0;  ///< when the position was measured
    std::int64_t force_ns = 0;     ///< the instant the force stands for
  };

  /// Returns r in N. `in_contact`: the jerk is the object's doing and teaches nothing about free motion.
  /// After a gap (TickInterval::is_gap) all of the force counts as residual. A tick that brings no new force,
  /// or follows another at once, changes nothing.
  Value update(const Measurement& now, bool in_contact) noexcept;
  /// Updates with a force that is the mean since the last tick, read with the position at `time_ns`.
  Value update(const Value& sensor_force_n, const Value& position_mm, std::int64_t time_ns,
               bool in_contact) noexcept;
  /// The next sample starts afresh; whatever it reads counts as residual.
  void reset() noexcept { samples_ = 0; }
  /// The tool is known to be free now: what the filters still remember of the contact is dropped, and the
  /// present reading is taken for inertia.
  void assume_free() noexcept;
  /// Starts with the last sample alone: those before it came from before a gap.
  void start_free() noexcept;

  /// Widens the dead zone for a sensor that is noisier than a quiet one, by so much.
  void set_excess_noise(double noise_n) noexcept { noise_n_ = kNoiseDeviations * noise_n; }

  const Value& residual_n() const noexcept { return residual_n_; }
  /// Present half-width of the dead zone.
  double explained_by_jerk_n() const noexcept { return seen_jerk_n_ + unseen_n_ + irregular_n_ + noise_n_; }
  /// u: what irregular intervals leave uncertain in r.
  double irregular_n() const noexcept { return irregular_n_; }
  /// Upper bound of what free motion may leave in prompt_force_n(), j_0 aside.
  double seen_jerk_n() const noexcept { return seen_jerk_n_; }
  /// f_s - L[m a], f_s the mean of the last kPromptMeanS: prompt, but off by up to the dead zone. For looking
  /// back at how a contact began.
  Value prompt_force_n() const noexcept { return prompt_force_.mean() - last_inertia_n_; }
  /// The instant that it stands for: the middle of the mean.
  std::int64_t prompt_force_ns() const noexcept { return last_.force_ns - prompt_age_ns_; }

 private:
  /// All that passes L, in pairs.
  class Signals {
   public:
    Signals() noexcept = default;
    Signals(const Value& residual_n, const Value& force_n, const Value& inertia_n) noexcept {
      if constexpr (kIsScalar) {
        pairs_ = {NumberPair{residual_n, force_n}, NumberPair{inertia_n, 0.0}};
      } else {
        pairs_ = {NumberPair{residual_n.x, residual_n.y}, NumberPair{force_n.x, force_n.y},
                  NumberPair{inertia_n.x, inertia_n.y}, NumberPair{residual_n.z, force_n.z},
                  NumberPair{inertia_n.z, 0.0}};
      }
    }

    Value residual_n() const noexcept { return signal(0); }
    Value force_n() const noexcept { return signal(1); }
    Value inertia_n() const noexcept { return signal(2); }

    auto& parts() noexcept { return pairs_; }
    const auto& parts() const noexcept { return pairs_; }

   private:
    static constexpr bool kIsScalar = std::is_same_v<Value, double>;
    static constexpr std::size_t kPairs = kIsScalar ? 2 : 5;

    Value signal(std::size_t i) const noexcept {
      if constexpr (kIsScalar) {
        return pairs_[i / 2][i % 2];
      } else {
        return {pairs_[i][0], pairs_[i][1], pairs_[3 + i / 2][i % 2]};
      }
    }

    std::array<NumberPair, kPairs> pairs_{};
  };

  void seed(const Signals& signals) noexcept;

  static constexpr double kCutoffHz =
      40.0;  // two sections: 11 ms of delay, 2 mN of encoder noise through 9 g
  static constexpr double kJerkMargin = 1.3;       // γ: the jerk is itself seen late
  static constexpr double kNoiseDeviations = 4.5;  // of the length of three components
  static constexpr double kJerkMemoryS = 0.15;     // violent motion does not end within a stroke
  // A tick's force is the mean of the sensor's samples since the last one: noisier the faster the loop. With
  // 9 g, threshold and j_0's dead zone are 27 mN: ten times the noise of 0.5 ms, four times that of 0.1 ms.
  static constexpr double kLeadMeanS = 0.5e-3;
  static constexpr double kBeforeS = 5e-3;  // long enough that an encoder step bends a filled interval little
  // A brisk reach, 0.1 m in 0.4 s; encoders show no jerk before τ has passed.
  static constexpr double kUnseenJerkMmPerS3 = 1.2e5;

  void start(const Measurement& now) noexcept;
  /// Steps of a period through an interval that was longer.
  void fill(const Measurement& now, double step_s, bool in_contact) noexcept;
  void step(const Measurement& now, double step_s, bool in_contact) noexcept;

  double tool_mass_g_;
  double rate_hz_;
  double delay_s_;
  std::int64_t prompt_age_ns_;  ///< by which the mean of prompt_force_n() is older than a tick's force
  double unseen_jerk_n_per_s_;  ///< m j_0
  double unseen_n_;
  SlidingMean<Value> lead_force_, prompt_force_;
  BasicButterworthLowPass<Signals> section_1_, section_2_;  // L
  InstantRing<Value> positions_, forces_, inertias_;
  int samples_ = 0;
  Measurement last_{};  ///< that was used
  double last_step_s_ = 0.0;
  Value last_velocity_mm_per_s_{};
  Value last_inertia_n_{};
  double jerk_n_per_s_ = 0.0;  ///< envelope of d(m a)/dt
  double seen_jerk_n_ = 0.0;   ///< γ τ times it
  double irregular_n_ = 0.0;
  double noise_n_ = 0.0;  ///< that a single reading has, beyond a quiet sensor's
  Value residual_n_{};
};

using FreeMotionResidual = BasicFreeMotionResidual<double>;
using FreeMotionResidual3 = BasicFreeMotionResidual<hal::Vector3>;
extern template class BasicFreeMotionResidual<double>;
extern template class BasicFreeMotionResidual<hal::Vector3>;

}  // namespace hapticd::rt
