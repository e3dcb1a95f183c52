#pragma once

#include <algorithm>
#include <cstdint>

namespace hapticd::netft {

/// Checks whether the numbers of a stream can be those of one box. A box restarts once in a while, and
/// records get lost: both are reported elsewhere and forgiven. Not forgiven are
/// - numbers ahead of time: more records than can have been measured. Their sum, which decays by 0.1 s per
/// second, must not exceed one second. A gap whose length fits the elapsed time (a cable, a stalled machine)
/// does not count;
/// - a second restart within ten seconds that was not requested.
/// Both mean that another program sends in the box's name, or that the box fails.
class RdtContinuity {
 public:
  static constexpr double kMaxAheadNs = 1e9;
  static constexpr double kForgottenShare = 0.1;
  static constexpr std::int64_t kRestartsApartNs = 10'000'000'000;

  /// Notes a record that was `ahead_ns` ahead of time. True: the stream cannot be trusted.
  bool note_ahead(double ahead_ns, std::int64_t now_ns) noexcept {
    const double passed_ns = static_cast<double>(std::max<std::int64_t>(0, now_ns - ahead_at_ns_));
    ahead_ns_ = std::max(0.0, ahead_ns_ - kForgottenShare * passed_ns) + ahead_ns;
    ahead_at_ns_ = now_ns;
    if (ahead_ns_ <= kMaxAheadNs) return false;
    ahead_ns_ = 0.0;
    return true;
  }

  /// Notes that the stream was requested (again): its numbers may restart once.
  void note_request() noexcept { may_restart_ = true; }

  /// Notes that the numbers restarted. True: the stream cannot be trusted.
  bool note_restart(std::int64_t now_ns) noexcept {
    if (may_restart_) {
      may_restart_ = false;
      return false;
    }
    const bool again = has_restarted_ && now_ns - restarted_at_ns_ < kRestartsApartNs;
    has_restarted_ = true;
    restarted_at_ns_ = now_ns;
    return again;
  }

 private:
  double ahead_ns_ = 0.0;
  std::int64_t ahead_at_ns_ = 0;
  bool may_restart_ = false;
  bool has_restarted_ = false;
  std::int64_t restarted_at_ns_ = 0;
};

}  // namespace hapticd::netft
