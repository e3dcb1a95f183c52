#include "client/console/console_shared.h"

#include <algorithm>
#include <utility>
#include <vector>

#include "client/console/socket_session.h"

namespace hapticd::console {

namespace {
constexpr std::size_t kMaxRates = 4096;
/// Bytes that may wait for all pages together.
constexpr std::size_t kMaxQueuedOfAll = std::size_t{64} << 20U;
}  // namespace

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
  sockets.remove_if([](const auto& weak) {
    const auto socket = weak.lock();
    return !socket || socket->is_over();
  });
  return sockets.size();
}

bool ConsoleShared::make_place_for(const std::string& identity) {
  if (count_sockets() < options.max_sockets) return true;
  std::map<std::string, std::vector<std::shared_ptr<SocketSession>>> pages;  // the oldest first
  for (const auto& weak : sockets) {
    if (auto socket = weak.lock()) pages[socket->identity()].push_back(std::move(socket));
  }
  const std::size_t own = pages[identity].size() + 1;
  const auto most = std::max_element(pages.begin(), pages.end(), [](const auto& one, const auto& other) {
    return one.second.size() < other.second.size();
  });
  if (most->second.size() <= own) return false;
  most->second.front()->end_for_others();
  return true;
}

bool ConsoleShared::send_next_rows() {
  if (due_rows.empty()) return false;
  const auto [page, tap] = std::move(due_rows.front());
  due_rows.pop_front();
  if (const auto session = page.lock()) session->send_rows(tap);
  return true;
}

void ConsoleShared::limit_queued() {
  if (queued_bytes <= kMaxQueuedOfAll) return;
  std::shared_ptr<SocketSession> fullest;
  for (const auto& weak : sockets) {
    auto socket = weak.lock();
    if (!socket || socket->is_over()) continue;
    if (!fullest || socket->queued_bytes() > fullest->queued_bytes()) fullest = std::move(socket);
  }
  if (fullest) fullest->end_for_slowness();
}

}  // namespace hapticd::console
