#include "client/console/console_shared.h"

#include <utility>

namespace hapticd::console {

namespace {
constexpr std::size_t kMaxRates = 4096;
}

bool ConsoleShared::may_ask(const Who& who) {
  const auto now = std::chrono::steady_clock::now();
  if (!who) return strangers.take(now);
  last_used = now;
  if (rates.size() > kMaxRates) rates.clear();
  return rates.try_emplace(who->name, options.max_requests_per_s).first->second.take(now);
}

Caller ConsoleShared::caller_of(const Session& who, std::string peer) const {
  if (options.is_personal) return {};  // it has the right connection already
  return {who.name, who.serial, std::move(peer), {}};
}

std::shared_ptr<TelemetryFeed> ConsoleShared::feed_of(const Caller& caller) {
  std::erase_if(feeds, [](const auto& entry) { return entry.second.expired(); });
  std::weak_ptr<TelemetryFeed>& known = feeds[caller.name + " " + caller.serial];
  std::shared_ptr<TelemetryFeed> feed = known.lock();
  if (!feed || feed->end()) {
    Caller without_lease = caller;
    without_lease.lease.clear();
    feed = TelemetryFeed::open(bridge, without_lease, post);
    known = feed;
  }
  return feed;
}

std::size_t ConsoleShared::count_sockets() {
  sockets.remove_if([](const auto& socket) { return socket.expired(); });
  return sockets.size();
}

}  // namespace hapticd::console
