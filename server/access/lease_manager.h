#pragma once

#include <chrono>
#include <cstdint>
#include <deque>
#include <optional>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "hal/lock/callback.h"
#include "hal/lock/mutex.h"
#include "server/access/identity.h"
#include "server/access/lease_state.h"
#include "server/session/caller.h"
#include "server/session/outcome.h"

namespace hapticd::server {

/// Manages who controls the rig. Every change of control has a number, which goes to the loop at the same
/// instant: a command carries the number under which it was admitted, and at its tick the loop compares. Any
/// thread.
class LeaseManager {
 public:
  using Clock = std::chrono::steady_clock;

  /// What a change of control has the rest of the daemon do: in the order of these members, in the thread
  /// that noticed the change, before its call returns. No lock is held meanwhile, so other calls go on;
  /// changes that follow one another at once may reach the rest in another order, which their numbers show.
  struct Effects {
    /// Publishes a number to the loop: commands under a lower one take no effect any more. Returns the last
    /// completed tick.
    Callback<std::uint64_t(std::uint64_t number)> publish = [](std::uint64_t) { return std::uint64_t{0}; };
    /// Called when the holder was not heard of.
    Callback<void(LeaseExpiry)> expired = [](LeaseExpiry) {};
    /// Called when a lease that was held is over against its holder's will: ends what runs under this number.
    Callback<void(std::uint64_t number, const hal::Error& why)> lost = [](auto, const auto&) {};
  };

  LeaseManager(Effects effects, std::chrono::nanoseconds take_notice);
  ~LeaseManager();
  LeaseManager(const LeaseManager&) = delete;
  LeaseManager& operator=(const LeaseManager&) = delete;

  struct Admitted {
    std::uint64_t number = 0;  ///< the command goes under it
    bool by_holder = false;    ///< not merely because the lease has no holder
  };
  /// Holder by whom a command has to come while a client holds the lease: the program with its token, or any
  /// program of the same identity.
  enum class Holder : std::uint8_t { kProgram, kIdentity };
  /// Admits a command if it may be given now. Renews the lease of its holder.
  Outcome<Admitted> admit(const Identity& who, const std::string& token, LeaseRule rule,
                          Holder holder = Holder::kProgram) EXCLUDES(mutex_);
  /// Notes that the holder was heard of. Nothing if the token is of no lease in force.
  void note_use(const Identity& who, const std::string& token) EXCLUDES(mutex_);

  Outcome<LeaseGranted> acquire(const Identity& who, const LeaseTerms& terms);
  /// Waits as long as the holder has notice.
  Outcome<LeaseGranted> take(const Identity& who, const LeaseTerms& terms, const std::string& reason,
                             const Caller& caller);
  Outcome<LeaseView> renew(const Identity& who, const std::string& token);
  void give_back(const Identity& who, const std::string& token);

  LeaseSnapshot snapshot() const;
  /// The state, once it differs from that of `version`, or at `until`.
  LeaseSnapshot await_change(std::uint64_t version, Clock::time_point until) const;
  /// Reason why what was admitted under `number` may command no longer; nothing while it may.
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

  /// Effects that are due, in the order of the changes they are of: collected under the lock.
  struct Due {
    std::optional<std::uint64_t> number;
    std::vector<LeaseExpiry> expired;
    std::vector<std::pair<std::uint64_t, hal::Error>> lost;
    std::vector<std::string> log;
  };
  /// Performs them. Returns the tick after which control has changed; 0 if it has not.
  std::uint64_t perform(const Due& due) const EXCLUDES(mutex_);
  /// Performs them when it is destroyed: declared before the lock, that is after the lock is free.
  class Afterwards {
   public:
    explicit Afterwards(const LeaseManager& leases) : leases_(leases) {}
    ~Afterwards() { leases_.perform(due); }
    Afterwards(const Afterwards&) = delete;
    Afterwards& operator=(const Afterwards&) = delete;
    Due due;

   private:
    const LeaseManager& leases_;
  };

  bool holds(const Identity& who, const std::string& token) const REQUIRES(mutex_);
  bool is_stale(Clock::time_point now) const REQUIRES(mutex_);
  LeaseView view(Clock::time_point now) const REQUIRES(mutex_);
  LeaseGranted grant(const Identity& who, const LeaseTerms& terms, LeaseChange change,
                     const std::string& reason, Due& due) REQUIRES(mutex_);
  Outcome<LeaseGranted> take_collecting(const Identity& who, const LeaseTerms& terms,
                                        const std::string& reason, const Caller& caller, Due& due)
      EXCLUDES(mutex_);
  /// Changes the control: the number rises, the holder is removed.
  void change_control(LeaseChange change, const std::string& by, const std::string& reason, Due& due)
      REQUIRES(mutex_);
  LeaseSnapshot snapshot_locked() const REQUIRES(mutex_);
  Refusal held_by_another(Clock::time_point now) const REQUIRES(mutex_);
  /// Reason why a lease is over: by its token, or by its number. The last change if it is not remembered.
  Refusal over(const std::string& token, std::uint64_t number = 0) const REQUIRES(mutex_);
  void expire_locked(Due& due) REQUIRES(mutex_);
  void run();

  const Effects effects_;
  const std::chrono::nanoseconds take_notice_;
  mutable Mutex mutex_;
  mutable Condition changed_;
  Condition wake_;  ///< of the thread that watches the times to live
  std::optional<Held> held_ GUARDED_BY(mutex_);
  std::optional<Take> take_ GUARDED_BY(mutex_);
  std::deque<Ended> ended_ GUARDED_BY(mutex_);  ///< the newest first
  LeaseChange last_change_ GUARDED_BY(mutex_) = LeaseChange::kNone;
  std::string changed_by_ GUARDED_BY(mutex_);
  std::string reason_ GUARDED_BY(mutex_);
  std::uint64_t number_ GUARDED_BY(mutex_) = 1;
  std::uint64_t version_ GUARDED_BY(mutex_) = 1;
  std::uint64_t takes_ GUARDED_BY(mutex_) = 0;
  bool ending_ GUARDED_BY(mutex_) = false;
  std::thread thread_;  // last: uses all of the above
};

}  // namespace hapticd::server
