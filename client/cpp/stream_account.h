#pragma once

#include <cstdint>

namespace hapticd::client {

/// Counts what came in a telemetry stream and what is missing: ticks are numbered, and the daemon reports
/// what it dropped. A stream is complete only when complete() says so. Use it from one thread.
class StreamAccount {
 public:
  /// `decimation` as asked for; 0 counts as 1.
  explicit StreamAccount(std::uint32_t decimation = 1) noexcept
      : decimation_(decimation == 0 ? 1 : decimation) {}

  /// Counts one sample; returns how many are missing directly before it.
  std::uint64_t add(std::uint64_t tick) noexcept;
  /// The counts the daemon sends with each batch; both run from the stream's start.
  void set_dropped(std::uint64_t by_subscriber, std::uint64_t by_server) noexcept;

  /// Samples that came.
  std::uint64_t samples() const noexcept { return samples_; }
  /// Places where samples are missing.
  std::uint64_t gaps() const noexcept { return gaps_; }
  /// Samples missing in all gaps together.
  std::uint64_t missing() const noexcept { return missing_; }
  /// Samples whose tick did not follow the one before: repeated, or out of order.
  std::uint64_t disordered() const noexcept { return disordered_; }
  /// Lost because this client read too slowly, as reported by the daemon.
  std::uint64_t dropped_by_subscriber() const noexcept { return dropped_by_subscriber_; }
  /// Lost by the daemon for all its subscribers, as reported by the daemon.
  std::uint64_t dropped_by_server() const noexcept { return dropped_by_server_; }

  /// No gap, nothing out of order, nothing dropped.
  bool complete() const noexcept {
    return gaps_ == 0 && disordered_ == 0 && dropped_by_subscriber_ == 0 && dropped_by_server_ == 0;
  }

 private:
  std::uint32_t decimation_;
  std::uint64_t last_tick_ = 0;
  std::uint64_t samples_ = 0;
  std::uint64_t gaps_ = 0;
  std::uint64_t missing_ = 0;
  std::uint64_t disordered_ = 0;
  std::uint64_t dropped_by_subscriber_ = 0;
  std::uint64_t dropped_by_server_ = 0;
};

}  // namespace hapticd::client
