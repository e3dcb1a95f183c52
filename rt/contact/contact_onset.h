#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include "rt/record/onset_instant.h"
#include "rt/signal/ticks.h"
#include "rt/signal/vector.h"

namespace hapticd::rt {

/// Finds where a contact began. It is declared when the force is beyond doubt, a little after the tip
/// touched; meanwhile the tip went deeper, and taking the place of declaration for the surface would make
/// every displacement too small (0.1-0.3 mm on a soft object). So the recent past is kept, and searched for
/// the last tick at which the force was still nothing. `Place` is a depth along the press axis or a point.
///
/// The force is the mean of a time, FreeMotionResidual::prompt_force_n(), or noise of a single tick would
/// bring a late place within what is quiet. Its place is that in the middle of that time, and a little
/// before: of ticks that share most of their mean the last quiet one is quiet by chance. If a mean is one
/// tick, both are of this tick.
template <class Place>
class BasicContactOnset {
 public:
  static constexpr double kMemoryS = 0.032;
  static constexpr double kForceAgeS = 0.6e-3;
  static constexpr double kFitS =
      3.5e-3;  ///< after the last quiet tick the force grows about linearly so long
  static constexpr std::size_t kMaxTicks = 320;  ///< kMemoryS at 10 kHz; a faster loop remembers less

  explicit BasicContactOnset(double rate_hz) noexcept
      : memory_(std::min<std::size_t>(ticks_of(kMemoryS, rate_hz), kMaxTicks)),
        force_age_(std::min(whole_ticks_in(kForceAgeS, rate_hz), memory_ - 1)),
        rate_hz_(rate_hz) {}

  /// `force_ns`: the instant that the force stands for; `late_s`: that of the place is so much later.
  void remember(const Place& place_mm, const Place& prompt_force_n, std::int64_t force_ns = 0,
                double late_s = 0.0) noexcept {
    newest_ = newest_ + 1 < memory_ ? newest_ + 1 : 0;
    ring_[newest_] = {place_mm, magnitude(prompt_force_n), force_ns, late_s};
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
    // Whole ticks, by which the place is later.
    const double late_ticks = std::clamp(before(age).late_s * rate_hz_, 0.0, static_cast<double>(memory_));
    return before(std::min(age + force_age_ + static_cast<std::size_t>(late_ticks), oldest)).place_mm;
  }

  /// Instant at which the contact began: where the straight line through the force of the last quiet tick and
  /// of what came up to kFitS after it was zero. A hard touch is declared within a tick or two: then a force
  /// that grows from zero within a tick, whose mean is what was read, says more (sudden_s()). It was not
  /// later than the end of the first tick beyond `quiet_n`, and not earlier than this line would have needed
  /// to hide that much twice.
  OnsetInstant instant(double quiet_n) const noexcept {
    if (filled_ == 0) return {};
    // An irregular clock may explain all of this force; it was declared all the same.
    quiet_n = std::min(quiet_n, 0.5 * before(0).force_n);
    const std::size_t oldest = filled_ - 1;
    std::size_t quiet = 0;
    while (quiet < oldest && !(before(quiet).force_n <= quiet_n)) ++quiet;
    const std::int64_t from_ns = before(quiet).force_ns;
    const std::int64_t loud_ns = before(quiet > 0 ? quiet - 1 : 0).force_ns;
    const std::int64_t latest_ns = loud_ns + (loud_ns - from_ns) / 2;
    // Times from the quiet tick.
    double n = 0.0, sum_s = 0.0, sum_n = 0.0, sum_ss = 0.0, sum_sn = 0.0;
    for (std::size_t age = quiet + 1; age-- > 0;) {
      const double s = 1e-9 * static_cast<double>(before(age).force_ns - from_ns);
      if (s > kFitS) break;
      const double force_n = before(age).force_n;
      n += 1.0;
      sum_s += s;
      sum_n += force_n;
      sum_ss += s * s;
      sum_sn += s * force_n;
    }
    const double spread = n * sum_ss - sum_s * sum_s;
    const double slope = spread > 0.0 ? (n * sum_sn - sum_s * sum_n) / spread : 0.0;
    if (!(slope > 0.0)) return {latest_ns, before(oldest).force_ns, latest_ns};
    const auto ns = [&](double s) { return from_ns + static_cast<std::int64_t>(1e9 * s); };
    const double zero_s = quiet <= 2 && before(quiet).force_n < kSuddenShare * before(quiet - 1).force_n
                              ? sudden_s(quiet, quiet_n)
                              : std::max((sum_s - sum_n / slope) / n, -kMemoryS);
    const double hidden_s = std::min(2.0 * quiet_n / slope, kMemoryS);
    const std::int64_t began_ns = std::min(ns(zero_s), latest_ns);
    return {began_ns, ns(std::min(zero_s - hidden_s, 0.0)), latest_ns};
  }

 private:
  static constexpr double kSuddenShare = 0.25;  ///< of the first force beyond what is quiet

  /// Time from the last quiet tick, `quiet` = 1 or 2 ticks ago, to the beginning of the contact. A force
  /// k (t - t_0) that begins e before the end of a tick of length T has the mean k e²/2T there, and k (e +
  /// T/2) in the next one. If there is one only, it began anywhere within T, the part that is hidden in what
  /// is quiet before it.
  double sudden_s(std::size_t quiet, double quiet_n) const noexcept {
    const Moment& first = before(quiet - 1);
    const double tick_s = 1e-9 * static_cast<double>(first.force_ns - before(quiet).force_ns);
    double e = 0.5 + std::min(1.0, std::sqrt(2.0 * quiet_n / first.force_n));
    if (quiet == 2) {
      const double share = first.force_n / std::max(before(0).force_n, first.force_n);
      e = std::min(share + std::sqrt(share * share + share), 1.5);
    }
    return tick_s * (1.5 - e);
  }

  struct Moment {
    Place place_mm{};
    double force_n = 0.0;
    std::int64_t force_ns = 0;
    double late_s = 0.0;  ///< by which the place is later
  };
  const Moment& before(std::size_t age) const noexcept {
    return ring_[newest_ >= age ? newest_ - age : newest_ + memory_ - age];
  }

  std::size_t memory_;
  std::size_t force_age_;
  double rate_hz_;
  std::array<Moment, kMaxTicks> ring_{};
  std::size_t newest_ = 0;
  std::size_t filled_ = 0;
};

using ContactOnset = BasicContactOnset<double>;
using ContactOnset3 = BasicContactOnset<hal::Vector3>;

}  // namespace hapticd::rt
