#include "server/connection/connection_table.h"

#include <fmt/format.h>
#include <sys/random.h>

#include <charconv>

namespace hapticd::server {

namespace {

constexpr std::string_view kName = "hapticd-connection-";
constexpr char kAdmitted = 'a';
constexpr char kDenied = 'd';

/// Name that cannot be known before: whoever gives the name to a socket first keeps it from the relay, and
/// every user of this machine may.
std::uint64_t unforeseeable() {
  std::uint64_t bits = 0;
  while (getrandom(&bits, sizeof bits, 0) != static_cast<ssize_t>(sizeof bits)) {
  }
  return bits;
}

/// "a17" of "unix-abstract:hapticd-connection-91b2c3d4e5f60718-a17"; empty for other names.
std::string_view mark_of(std::string_view peer) {
  const std::size_t at = peer.rfind(kName);
  if (at == std::string_view::npos) return {};
  const std::string_view rest = peer.substr(at + kName.size());
  const std::size_t dash = rest.find('-');
  return dash == std::string_view::npos ? std::string_view() : rest.substr(dash + 1);
}

std::uint64_t number_of(std::string_view peer) {
  const std::string_view mark = mark_of(peer);
  std::uint64_t number = 0;
  if (mark.size() > 1) std::from_chars(mark.data() + 1, mark.data() + mark.size(), number);
  return number;
}

}  // namespace

std::string ConnectionTable::add(Identity who) {
  const char mark = who.is_denied ? kDenied : kAdmitted;
  const MutexLock lock(mutex_);
  const std::uint64_t number = ++last_;
  connections_.emplace(number, std::move(who));
  return fmt::format("{}{:016x}-{}{}", kName, unforeseeable(), mark, number);
}

void ConnectionTable::close(std::string_view name, Clock::time_point now) {
  const std::uint64_t number = number_of(name);
  const MutexLock lock(mutex_);
  if (connections_.contains(number)) closed_.emplace_back(now + kKept, number);
  while (!closed_.empty() && (closed_.front().first <= now || closed_.size() > kMaxClosed)) {
    connections_.erase(closed_.front().second);
    closed_.pop_front();
  }
}

std::optional<Identity> ConnectionTable::find(std::string_view peer) const {
  const std::uint64_t number = number_of(peer);
  const MutexLock lock(mutex_);
  const auto found = connections_.find(number);
  if (found == connections_.end()) return std::nullopt;
  return found->second;
}

bool ConnectionTable::is_relayed(std::string_view peer) {
  return !mark_of(peer).empty();
}

bool ConnectionTable::is_denied(std::string_view peer) {
  return mark_of(peer).starts_with(kDenied);
}

}  // namespace hapticd::server
