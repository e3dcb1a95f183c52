#include "server/console/console_shared.h"

namespace hapticd::server {

namespace {
constexpr std::size_t kMaxRates = 4096;
}

bool ConsoleShared::may_ask(const Session& session) {
  const auto now = std::chrono::steady_clock::now();
  if (!session) return strangers.take(now);
  if (rates.size() > kMaxRates) rates.clear();
  return rates.try_emplace(session->who.name, config.max_requests_per_s).first->second.take(now);
}

std::shared_ptr<TelemetryFeed> ConsoleShared::feed_of(const ConsoleCaller& caller) {
  std::erase_if(feeds, [](const auto& entry) { return entry.second.expired(); });
  std::weak_ptr<TelemetryFeed>& known = feeds[caller.pass];
  std::shared_ptr<TelemetryFeed> feed = known.lock();
  if (!feed || feed->end()) {
    ConsoleCaller without_lease = caller;
    without_lease.lease.clear();
    feed = TelemetryFeed::open(bridge, without_lease, loop_rate_hz, post);
    known = feed;
  }
  return feed;
}

}  // namespace hapticd::server
