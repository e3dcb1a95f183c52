#pragma once

#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <deque>
#include <functional>
#include <mutex>
#include <optional>
#include <string>
#include <thread>

#include "server/access/identity.h"
#include "server/access/lease_state.h"
#include "server/session/caller.h"
#include "server/session/outcome.h"

namespace hapticd::server {

/// Who controls the rig. Every change of control has a number, which goes to the loop at the same instant: a
/// command carries the number under which it was admitted, and at its tick the loop compares. Any thread.
class LeaseDesk {
 public:
  using Clock = std::chrono::steady_clock;

  /// What a change of control has the rest of the daemon do. Called with the desk's lock held: must be short,
  /// and must not call the desk.
  struct Effects {
    /// To the loop: commands under another number take no effect any more. Returns the last completed tick.
    std::function<std::uint64_t(std::uint64_t number)> publish = [](std::uint64_t) { return 0; };
    /// A lease that was held is over against its holder's will: ends what runs under this number.
    std::function<void(std::uint64_t number, const hal::Error& why)> lost = [](auto, const auto&) {};
    /// The holder was not heard of.
    std::function<void(LeaseExpiry)> expired = [](LeaseExpiry) {};
  };

  LeaseDesk(Effects effects, std::chrono::nanoseconds take_notice);
  ~LeaseDesk();
  LeaseDesk(const LeaseDesk&) = delete;
  LeaseDesk& operator=(const LeaseDesk&) = delete;

  struct Admitted {
    std::uint64_t number = 0;  ///< the command goes under it
    bool by_holder = false;    ///< not merely because no one holds the lease
  };
  /// Whether a command may be given now. Renews the lease of its holder.
  Outcome<Admitted> admit(const Identity& who, const std::string& token, LeaseRule rule);
  /// The holder was heard of. Nothing where the token is of no lease in force.
  void note_use(const Identity& who, const std::string& token);

  Outcome<LeaseGranted> acquire(const Identity& who, const LeaseTerms& terms);
  /// Waits as long as the holder has notice.
  Outcome<LeaseGranted> take(const Identity& who, const LeaseTerms& terms, const std::string& reason,
                             const Caller& caller);
  Outcome<LeaseView> renew(const Identity& who, const std::string& token);
  void give_back(const Identity& who, const std::string& token);

  LeaseSnapshot snapshot() const;
  /// The state, once it differs from that of `version`, or at `until`.
  LeaseSnapshot await_change(std::uint64_t version, Clock::time_point until) const;
  /// Why what was admitted under `number` may command no longer; nothing while it may.
  std::optional<Refusal> lost(std::uint64_t number) const;
  /// Ends all waits.
  void shutdown();
  bool ended() const;

 private:
  struct Held {
    std::string holder;
    bool is_remote = false;
    std::string token;
    LeaseTerms terms;
    LeaseExpiry on_expiry = LeaseExpiry::kKeep;
    Clock::time_point since{};
    Clock::time_point last_use{};
  };
  struct Take {
    std::string taker;
    std::string reason;
    Clock::time_point due{};
    std::uint64_t serial = 0;
  };

  /// How a lease ended, for its former holder.
  struct Ended {
    std::string token;
    std::uint64_t number = 0;
    LeaseChange change = LeaseChange::kNone;
    std::string by;
    std::string reason;
  };
  static constexpr std::size_t kRemembered = 32;

  bool holds(const Identity& who, const std::string& token) const;
  bool is_stale(Clock::time_point now) const;
  LeaseView view(Clock::time_point now) const;
  LeaseGranted grant(const Identity& who, const LeaseTerms& terms, LeaseChange change,
                     const std::string& reason);
  /// Control changes: the number rises, the loop learns it. The holder is removed.
  std::uint64_t change_control(LeaseChange change, const std::string& by, const std::string& reason);
  LeaseSnapshot snapshot_locked() const;
  Refusal held_by_another(Clock::time_point now) const;
  /// Why a lease is over: by its token, or by its number. The last change where it is not remembered.
  Refusal over(const std::string& token, std::uint64_t number = 0) const;
  void expire_locked();
  void run();

  const Effects effects_;
  const std::chrono::nanoseconds take_notice_;
  mutable std::mutex mutex_;
  mutable std::condition_variable changed_;
  std::condition_variable wake_;  ///< of the thread that watches the times to live
  std::optional<Held> held_;
  std::optional<Take> take_;
  std::deque<Ended> ended_;  ///< the newest first
  LeaseChange last_change_ = LeaseChange::kNone;
  std::string changed_by_;
  std::string reason_;
  std::uint64_t number_ = 1;
  std::uint64_t version_ = 1;
  std::uint64_t takes_ = 0;
  bool ending_ = false;
  std::thread thread_;  // last: uses all of the above
};

}  // namespace hapticd::server
