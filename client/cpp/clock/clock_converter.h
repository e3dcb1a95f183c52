#pragma once

#include <cstdint>
#include <deque>

#include "client/cpp/clock/clock_estimator.h"

namespace hapticd::client {

/// Turns times of the client's clock into those of the daemon's, without jumps: when the estimate changes, it
/// runs up to 500 ppm faster or slower until it has caught up. A later time never becomes an earlier one.
///
/// Times may be asked for in any order: those of the last 256 estimates are converted as they were then. No
/// estimate changes what was answered, so that a time far ahead keeps the new ones from having an effect.
///
/// Converts between clocks. Not for several threads at once.
class ClockConverter {
 public:
  static constexpr double kSlewPpm = 500.0;

  bool empty() const noexcept { return pieces_.empty(); }
  /// A new estimate: the first is taken as it is, others are followed.
  void follow(const ClockBounds& now, double drift_ppm);
  /// Converts to the daemon's clock. Not while empty().
  std::int64_t to_daemon_ns(std::int64_t client_ns);

 private:
  /// Piece of the conversion from a time of the client's clock on, until the next piece.
  struct Piece {
    std::int64_t begin_ns = 0;
    std::int64_t offset_ns = 0;  ///< where it is led to, at begin_ns
    double drift = 0.0;          ///< of that, in 1
    double left_ns = 0.0;        ///< how far it is from there, at begin_ns

    /// Part of the offset beyond offset_ns.
    double beyond_ns(std::int64_t client_ns) const;
  };
  static constexpr std::size_t kPieces = 256;

  const Piece& piece_at(std::int64_t client_ns) const;

  std::deque<Piece> pieces_;
  std::int64_t last_asked_ns_ = 0;     ///< the latest time that was asked for
  std::int64_t last_answered_ns_ = 0;  ///< what it became
  bool was_asked_ = false;
};

}  // namespace hapticd::client
