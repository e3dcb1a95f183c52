#pragma once

#include <chrono>
#include <cstddef>
#include <memory>

namespace hapticd::server {

/// Allowance of so many at once, and so many a second in the long run.
class Allowance {
 public:
  using Time = std::chrono::steady_clock::time_point;

  constexpr Allowance(double at_once, double per_s) : at_once_(at_once), per_s_(per_s), left_(at_once) {}
  /// False when it is used up.
  bool take(Time now);
  /// Nothing of it is used up any more.
  bool is_full(Time now);

 private:
  void refill(Time now);

  double at_once_;
  double per_s_;
  double left_;
  Time since_{};
};

/// How much one identity may have under way on all of its connections together, so that what the service
/// keeps for it stays below 100 MB. gRPC 1.51 takes some 25 kB for each call, also for one that was given up.
struct AccountLimits {
  int max_connections = 512;
  int max_calls = 800;                                        ///< opened and not answered yet
  std::size_t max_unfinished_bytes = std::size_t{32} << 20U;  ///< of headers and requests of those calls
  /// Shorter pieces in which those requests come. gRPC keeps the whole block of 8 kB into which it reads one.
  std::size_t max_pieces = 4000;
  double max_resets_at_once = 500.0;  ///< calls that the client gave up
  double max_resets_per_s = 100.0;
  double max_controls_at_once = 2000.0;  ///< pings, settings and other frames outside calls
  double max_controls_per_s = 500.0;
};

/// The one count for an identity. One thread.
struct Account {
  explicit Account(const AccountLimits& given)
      : limits(given),
        resets(given.max_resets_at_once, given.max_resets_per_s),
        controls(given.max_controls_at_once, given.max_controls_per_s) {}

  const AccountLimits limits;
  int connections = 0;
  int calls = 0;
  std::size_t unfinished_bytes = 0;
  std::size_t pieces = 0;
  Allowance resets;
  Allowance controls;
};

}  // namespace hapticd::server
