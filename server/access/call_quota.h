#pragma once

#include <chrono>
#include <map>
#include <memory>
#include <string>

#include "hal/lock/mutex.h"
#include "server/session/outcome.h"

namespace hapticd::server {

/// How much of the daemon each identity may have: calls and streams at once, and calls a second. Any thread.
class CallQuota {
 public:
  using Clock = std::chrono::steady_clock;
  /// Held for as long as a call lasts.
  using Place = std::shared_ptr<const void>;

  /// `max_calls_per_s`: as many may come at once after a second of silence.
  CallQuota(int max_calls, double max_calls_per_s);

  /// Takes a place for one more call of `identity`. RESOURCE_EXHAUSTED beyond either limit.
  Outcome<Place> take(const std::string& identity, Clock::time_point now);

 private:
  struct Account {
    int calls = 0;
    double allowance = 0.0;  ///< calls that may begin now
    Clock::time_point since{};
  };
  struct Accounts {
    Mutex mutex;
    std::map<std::string, Account> by_identity GUARDED_BY(mutex);
  };
  static void forget_idle(Accounts& accounts, Clock::time_point now) REQUIRES(accounts.mutex);

  const int max_calls_;
  const double max_calls_per_s_;
  const std::shared_ptr<Accounts> accounts_;  ///< places may outlive the quota
};

}  // namespace hapticd::server
