#pragma once

#include <chrono>
#include <map>
#include <optional>
#include <string>
#include <string_view>

#include "hal/lock/callback.h"
#include "hal/lock/mutex.h"

namespace hapticd::server {

/// The console that serves pages now, and the keys by which a browser becomes a client. A client asks for a
/// key that works once; the console redeems what a browser shows it. All functions may be called by any
/// thread.
class ConsoleRegistry {
 public:
  using Clock = Callback<std::chrono::steady_clock::time_point()>;
  struct Urls {
    std::string plain;  ///< "http://127.0.0.1:50080"; empty: none
    std::string tls;    ///< "https://rig.lab.example:8443"; empty: none
  };

  explicit ConsoleRegistry(Clock clock = &std::chrono::steady_clock::now) : clock_(std::move(clock)) {}

  /// Counts for 3 s.
  void report(Urls urls);
  /// Addresses of a console; empty if none has reported itself within this time.
  Urls urls() const;

  /// Issues a key for a browser of the identity with this name. It works once, for a minute. The last 8 keys
  /// of an identity work. Empty: others have too many open.
  std::string issue_key(const std::string& name);
  /// Redeems a key: the name that it was issued for; nothing if it is unknown, used or too old.
  std::optional<std::string> redeem(std::string_view key);

 private:
  struct Key {
    std::string name;
    std::chrono::steady_clock::time_point until;
  };
  void forget_old_keys(std::chrono::steady_clock::time_point now) REQUIRES(mutex_);
  void forget_surplus_of(const std::string& name) REQUIRES(mutex_);

  const Clock clock_;
  mutable Mutex mutex_;
  Urls urls_ GUARDED_BY(mutex_);
  std::chrono::steady_clock::time_point urls_until_ GUARDED_BY(mutex_){};
  std::map<std::string, Key, std::less<>> keys_ GUARDED_BY(mutex_);
};

}  // namespace hapticd::server
