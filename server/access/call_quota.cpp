#include "server/access/call_quota.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

namespace hapticd::server {

namespace {

/// Identities that are remembered before those without calls are forgotten.
constexpr std::size_t kManyIdentities = 1000;

Refusal too_many(const std::string& identity, std::string value, std::string limit, const char* remedy) {
  return {RefusalKind::kResourceExhausted,
          {"this identity has too many calls", identity, std::move(value), std::move(limit), remedy}};
}

}  // namespace

CallQuota::CallQuota(int max_calls, double max_calls_per_s)
    : max_calls_(max_calls), max_calls_per_s_(max_calls_per_s), accounts_(std::make_shared<Accounts>()) {}

Outcome<CallQuota::Place> CallQuota::take(const std::string& identity, Clock::time_point now) {
  Accounts& accounts = *accounts_;
  const MutexLock lock(accounts.mutex);
  if (accounts.by_identity.size() > kManyIdentities) forget_idle(accounts, now);
  const auto [found, is_new] = accounts.by_identity.try_emplace(identity);
  Account& account = found->second;
  const double silent_s = std::chrono::duration<double>(now - account.since).count();
  account.allowance =
      is_new ? max_calls_per_s_
             : std::min(max_calls_per_s_, account.allowance + std::max(0.0, silent_s) * max_calls_per_s_);
  account.since = std::max(account.since, now);
  if (account.calls >= max_calls_) {
    return too_many(identity, fmt::format("{} calls and streams at once", account.calls),
                    fmt::format("access.max_calls = {}", max_calls_),
                    "end some, or let one client serve many");
  }
  if (account.allowance < 1.0) {
    return too_many(identity, "more calls than it may in a second",
                    fmt::format("access.max_calls_per_s = {:g}", max_calls_per_s_),
                    "call less often: subscribe to telemetry where state is polled");
  }
  account.allowance -= 1.0;
  ++account.calls;
  return Place(this, [kept = accounts_, identity](const void*) {
    const MutexLock returning(kept->mutex);
    --kept->by_identity.at(identity).calls;
  });
}

void CallQuota::forget_idle(Accounts& accounts, Clock::time_point now) {
  std::erase_if(accounts.by_identity, [now](const auto& entry) {
    return entry.second.calls == 0 && now - entry.second.since > std::chrono::seconds(1);
  });
}

}  // namespace hapticd::server
