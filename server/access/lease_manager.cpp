#include "server/access/lease_manager.h"

#include <fmt/format.h>
#include <pthread.h>
#include <sys/random.h>

#include <algorithm>
#include <array>
#include <stdexcept>
#include <utility>

#include "server/process/log.h"

namespace hapticd::server {

namespace {

using std::chrono::duration;

constexpr std::chrono::milliseconds kLook{20};

double seconds(std::chrono::nanoseconds time) {
  return duration<double>(time).count();
}

/// 128 random bits.
std::string new_token() {
  std::array<unsigned char, 16> bytes{};
  if (getrandom(bytes.data(), bytes.size(), 0) != static_cast<ssize_t>(bytes.size())) {
    throw std::runtime_error("the kernel gives no random bytes");
  }
  std::string text;
  for (const unsigned char byte : bytes) text += fmt::format("{:02x}", byte);
  return text;
}

/// Takes as long whatever the difference.
bool same(const std::string& a, const std::string& b) {
  if (a.size() != b.size()) return false;
  unsigned difference = 0;
  for (std::size_t i = 0; i < a.size(); ++i) difference |= static_cast<unsigned char>(a[i] ^ b[i]);
  return difference == 0;
}

/// Reason that a person gave, behind a sentence that can do without.
std::string after_colon(const std::string& reason) {
  return reason.empty() ? std::string() : ": " + reason;
}

std::string in_words(LeaseChange change) {
  switch (change) {
    case LeaseChange::kNone:
      return "no one holds the lease";
    case LeaseChange::kAcquired:
      return "the lease was acquired";
    case LeaseChange::kTaken:
      return "the lease was taken";
    case LeaseChange::kReturned:
      return "the lease was returned";
    case LeaseChange::kExpired:
      return "the lease expired";
  }
  return {};
}

}  // namespace

LeaseManager::LeaseManager(Effects effects, std::chrono::nanoseconds take_notice)
    : effects_(std::move(effects)), take_notice_(take_notice) {
  effects_.publish(1);  // the first number
  thread_ = std::thread([this] { run(); });
}

LeaseManager::~LeaseManager() {
  shutdown();
  thread_.join();
}

void LeaseManager::shutdown() {
  const MutexLock lock(mutex_);
  ending_ = true;
  wake_.notify_all();
  changed_.notify_all();
}

bool LeaseManager::ended() const {
  const MutexLock lock(mutex_);
  return ending_;
}

bool LeaseManager::holds(const Identity& who, const std::string& token) const {
  return held_ && held_->holder == who.name && same(held_->token, token);
}

bool LeaseManager::is_stale(Clock::time_point now) const {
  return held_ && now - held_->last_use > held_->terms.ttl / 2;
}

LeaseView LeaseManager::view(Clock::time_point now) const {
  LeaseView view{number_, held_->holder, held_->terms, seconds(now - held_->since), 0.0, is_stale(now)};
  view.terms.on_expiry = held_->on_expiry;
  view.remaining_s = std::max(0.0, seconds(held_->terms.ttl - (now - held_->last_use)));
  return view;
}

Refusal LeaseManager::held_by_another(Clock::time_point now) const {
  return {RefusalKind::kFailedPrecondition,
          {fmt::format("another client, {}, has controlled the rig for {:.0f} s{}", held_->holder,
                       seconds(now - held_->since), after_colon(held_->terms.purpose)),
           "lease", "", "",
           "wait until it is returned (hapticctl lease watch), or take it: hapticctl lease hold --take "
           "WHY"},
          Reason::kLeaseHeld};
}

Refusal LeaseManager::over(const std::string& token, std::uint64_t number) const {
  Ended end{"", 0, last_change_, changed_by_, reason_};
  for (const Ended& one : ended_) {
    if (one.number != number && (token.empty() || !same(one.token, token))) continue;
    end = one;
    break;
  }
  const bool own_doing = end.change == LeaseChange::kReturned || end.change == LeaseChange::kExpired;
  return {
      RefusalKind::kAborted,
      {in_words(end.change) + (own_doing || end.by.empty() ? "" : " by " + end.by) + after_colon(end.reason),
       "lease", "", "", "acquire the lease, then send it again"},
      Reason::kLeaseLost};
}

std::uint64_t LeaseManager::perform(const Due& due) const {
  const std::uint64_t tick = due.number ? effects_.publish(*due.number) : 0;
  for (const LeaseExpiry action : due.expired) effects_.expired(action);
  for (const auto& [number, why] : due.lost) effects_.lost(number, why);
  for (const std::string& line : due.log) log_warning(line);
  return tick;
}

Outcome<LeaseManager::Admitted> LeaseManager::admit(const Identity& who, const std::string& token,
                                                    LeaseRule rule, Holder holder) {
  Afterwards after(*this);
  const MutexLock lock(mutex_);
  expire_locked(after.due);
  if (holds(who, token)) {
    held_->last_use = Clock::now();
    return Admitted{number_, true};
  }
  if (!token.empty()) return over(token);
  // It does not renew the lease: a program that has died stays dead.
  if (held_ && holder == Holder::kIdentity && held_->holder == who.name) return Admitted{number_, true};
  if (held_) return held_by_another(Clock::now());
  if (rule == LeaseRule::kRequired) {
    return Refusal{RefusalKind::kFailedPrecondition,
                   {"this command needs a lease", "lease", "", "",
                    "acquire one: in Python with rig.lease(), in C++ with .acquires_lease, elsewhere with "
                    "LeaseService.AcquireLease; hapticctl does it by itself"},
                   Reason::kLeaseRequired};
  }
  return Admitted{number_, false};
}

void LeaseManager::note_use(const Identity& who, const std::string& token) {
  Afterwards after(*this);
  const MutexLock lock(mutex_);
  expire_locked(after.due);
  if (holds(who, token)) held_->last_use = Clock::now();
}

LeaseGranted LeaseManager::grant(const Identity& who, const LeaseTerms& terms, LeaseChange change,
                                 const std::string& reason, Due& due) {
  Held next;
  next.holder = who.name;
  next.is_remote = who.is_remote();
  next.token = new_token();
  next.terms = terms;
  next.on_expiry = terms.on_expiry;
  if (terms.on_expiry == LeaseExpiry::kOfConnection) {
    next.on_expiry = who.is_remote() ? LeaseExpiry::kRampToZero : LeaseExpiry::kKeep;
  }
  next.since = next.last_use = Clock::now();
  change_control(change, who.name, reason, due);
  held_ = std::move(next);
  LeaseGranted granted;
  granted.lease = view(Clock::now());
  granted.token = held_->token;
  wake_.notify_all();
  return granted;
}

void LeaseManager::change_control(LeaseChange change, const std::string& by, const std::string& reason,
                                  Due& due) {
  if (held_) ended_.push_front({held_->token, number_, change, by, reason});
  if (ended_.size() > kRemembered) ended_.pop_back();
  held_.reset();
  take_.reset();
  ++number_;
  ++version_;
  last_change_ = change;
  changed_by_ = by;
  reason_ = reason;
  due.number = number_;
  changed_.notify_all();
}

Outcome<LeaseGranted> LeaseManager::acquire(const Identity& who, const LeaseTerms& terms) {
  Due due;
  Outcome<LeaseGranted> granted = [&]() -> Outcome<LeaseGranted> {
    const MutexLock lock(mutex_);
    expire_locked(due);
    if (held_) return held_by_another(Clock::now());
    return grant(who, terms, LeaseChange::kAcquired, terms.purpose, due);
  }();
  const std::uint64_t tick = perform(due);
  if (granted) granted->changed_after_tick = tick;
  return granted;
}

Outcome<LeaseGranted> LeaseManager::take(const Identity& who, const LeaseTerms& terms,
                                         const std::string& reason, const Caller& caller) {
  Due due;
  Outcome<LeaseGranted> granted = take_collecting(who, terms, reason, caller, due);
  const std::uint64_t tick = perform(due);
  if (granted) granted->changed_after_tick = tick;
  return granted;
}

Outcome<LeaseGranted> LeaseManager::take_collecting(const Identity& who, const LeaseTerms& terms,
                                                    const std::string& reason, const Caller& caller,
                                                    Due& due) {
  MutexLock lock(mutex_);
  expire_locked(due);
  if (!held_) return grant(who, terms, LeaseChange::kTaken, reason, due);
  if (take_) {
    return Refusal{
        RefusalKind::kAborted,
        {fmt::format("another client, {}, is taking the lease{}", take_->taker, after_colon(take_->reason)),
         "lease", "", "", "agree with it, then take it again"},
        Reason::kLeaseHeld};
  }
  const std::uint64_t number = number_;
  const std::uint64_t serial = ++takes_;
  const auto now = Clock::now();
  if (take_notice_ > Clock::duration::zero() && !is_stale(now)) {
    const auto until = now + std::chrono::duration_cast<Clock::duration>(take_notice_);
    take_ = Take{who.name, reason, until, serial};
    ++version_;
    changed_.notify_all();
    bool caller_waits = true;
    while (caller_waits && Clock::now() < until && number_ == number && !ending_) {
      changed_.wait_until(mutex_, std::min(until, Clock::now() + kLook));
      expire_locked(due);
      lock.unlock();
      caller_waits = !caller.cancelled() && Clock::now() < caller.deadline;
      lock.lock();
    }
    const bool given_up = Clock::now() < until && number_ == number;
    if (take_ && take_->serial == serial) {
      take_.reset();
      ++version_;
      changed_.notify_all();
    }
    if (given_up) {
      return Refusal{RefusalKind::kDeadlineExceeded,
                     {"the call ended before the holder's notice did; the lease was not taken", "lease", "",
                      fmt::format("at least {:.1f} s", seconds(take_notice_)), "allow more time"}};
    }
  }
  if (number_ != number && held_) return held_by_another(Clock::now());
  if (held_) {
    const std::uint64_t lost_number = number_;
    auto granted = grant(who, terms, LeaseChange::kTaken, reason, due);
    due.lost.emplace_back(lost_number, over({}, lost_number).error);
    return granted;
  }
  return grant(who, terms, LeaseChange::kTaken, reason, due);
}

Outcome<LeaseView> LeaseManager::renew(const Identity& who, const std::string& token) {
  Afterwards after(*this);
  const MutexLock lock(mutex_);
  expire_locked(after.due);
  if (!holds(who, token)) return over(token);
  held_->last_use = Clock::now();
  return view(Clock::now());
}

void LeaseManager::give_back(const Identity& who, const std::string& token) {
  Afterwards after(*this);
  const MutexLock lock(mutex_);
  if (holds(who, token)) change_control(LeaseChange::kReturned, who.name, {}, after.due);
}

LeaseSnapshot LeaseManager::snapshot_locked() const {
  const auto now = Clock::now();
  LeaseSnapshot state;
  if (held_) state.lease = view(now);
  state.change = last_change_;
  state.changed_by = changed_by_;
  state.reason = reason_;
  if (take_) {
    state.taker = take_->taker;
    state.take_reason = take_->reason;
    state.taken_in_s = std::max(0.0, seconds(take_->due - now));
  }
  state.number = number_;
  state.version = version_;
  return state;
}

LeaseSnapshot LeaseManager::snapshot() const {
  const MutexLock lock(mutex_);
  return snapshot_locked();
}

LeaseSnapshot LeaseManager::await_change(std::uint64_t version, Clock::time_point until) const {
  const MutexLock lock(mutex_);
  while (version_ == version && !ending_ && changed_.wait_until(mutex_, until)) {
  }
  return snapshot_locked();
}

std::optional<Refusal> LeaseManager::lost(std::uint64_t number) const {
  const MutexLock lock(mutex_);
  if (number == 0 || number == number_) return std::nullopt;
  return over({}, number);
}

// A holder that was stopped may ask for nothing at the very moment at which its time is over: the one who
// looks first ends it.
void LeaseManager::expire_locked(Due& due) {
  if (!held_ || Clock::now() - held_->last_use < held_->terms.ttl) return;
  const Held gone = *held_;
  const std::uint64_t lost_number = number_;
  change_control(LeaseChange::kExpired, gone.holder,
                 fmt::format("not heard of for {:g} s", seconds(gone.terms.ttl)), due);
  due.expired.push_back(gone.on_expiry);
  due.lost.emplace_back(lost_number, over({}, lost_number).error);
  due.log.push_back(
      fmt::format("the lease of {} expired: not heard of for {:g} s", gone.holder, seconds(gone.terms.ttl)));
}

void LeaseManager::run() {
  pthread_setname_np(pthread_self(), "lease");
  for (;;) {
    Afterwards after(*this);
    const MutexLock lock(mutex_);
    if (ending_) return;
    if (held_) {
      wake_.wait_until(mutex_,
                       held_->last_use + std::chrono::duration_cast<Clock::duration>(held_->terms.ttl));
    } else {
      wake_.wait(mutex_);
    }
    expire_locked(after.due);
  }
}

}  // namespace hapticd::server
