#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "server/config/watchdog_config.h"
#include "server/session/outcome.h"

namespace hapticd::server {

/// State of an endpoint of the watchdog.
enum class EndpointState : std::uint8_t {
  kAwaited,   ///< has not checked in since the daemon started
  kAlive,     ///< and pressed, if it is a pedal
  kReleased,  ///< alive, but its pedal is not pressed
  kMissing,   ///< not heard of for its time
};

/// What an endpoint says.
struct CheckInRecord {
  std::string endpoint;
  std::uint64_t sender = 0;     ///< chosen by the sender when it started; 0 = none
  std::uint64_t nonce = 0;      ///< of the answer before; 0 = begins
  std::optional<bool> pressed;  ///< of a pedal
  std::string who;              ///< identity of the client
};

/// What it is answered.
struct CheckInAnswer {
  std::uint64_t nonce = 0;  ///< for the next one
  bool counted = false;
  double timeout_ms = 0.0;
};

/// One endpoint as it is now.
struct EndpointView {
  EndpointConfig config;
  bool is_pedal = false;
  EndpointState state = EndpointState::kAwaited;
  double silent_ms = 0.0;  ///< since it checked in last; 0 while it is awaited
  std::string checked_in_by;
  std::uint64_t check_ins = 0;
  std::uint64_t wrong_nonces = 0;
};

/// Endpoints that check in, by which nonce, and which are missing. Knows no clock, no thread and no force:
/// times are given. Not for several threads at once.
class EndpointTable {
 public:
  using Time = std::chrono::steady_clock::time_point;

  /// `new_nonce`: a random number that cannot be guessed, never 0.
  EndpointTable(const WatchdogConfig& config, std::function<std::uint64_t()> new_nonce);

  /// Checks in. Refused: kNotFound (the name), kInvalidArgument (no sender; a pedal that does not say whether
  /// it is pressed), kFailedPrecondition (another sender is alive), kAborted (not the awaited nonce).
  Outcome<CheckInAnswer> check_in(const CheckInRecord& check_in, Time now);
  /// Marks those whose time is over as missing from now on; returns their names.
  std::vector<std::string> lapse(Time now);

  /// True if no endpoint is awaited or missing.
  bool all_alive() const;
  /// True if the last word of a pedal was that it is released.
  bool any_released() const;
  /// Time when the first of those that are alive will be missing; nothing if none is alive.
  std::optional<Time> next_lapse() const;
  std::vector<EndpointView> views(Time now) const;
  bool empty() const { return entries_.empty(); }

 private:
  struct Entry {
    EndpointConfig config;
    bool is_pedal = false;
    bool was_heard = false;
    bool is_alive = false;
    bool is_released = false;
    std::uint64_t sender = 0;
    std::uint64_t nonce = 0;  ///< the awaited one; 0 = none
    Time last{};
    std::string who;
    std::uint64_t check_ins = 0;
    std::uint64_t wrong_nonces = 0;

    Time lapses() const;
  };

  Outcome<Entry*> find(const std::string& name);

  std::vector<Entry> entries_;
  std::function<std::uint64_t()> new_nonce_;
};

/// "endpoint 'pedal' was not heard of for 1.2 s; …" of all that are not alive and pressed; empty if all are.
std::string missing_words(const std::vector<EndpointView>& views);

}  // namespace hapticd::server
