#include "server/connection/connection_relay.h"

#include <fmt/format.h>
#include <pthread.h>
#include <sys/epoll.h>
#include <sys/eventfd.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <utility>

#include "server/access/role_policy.h"
#include "server/connection/relayed_connection.h"
#include "server/process/log.h"

namespace hapticd::server {

namespace {

using Clock = std::chrono::steady_clock;

constexpr std::chrono::seconds kLookInterval{1};
/// Time for a client to take what was sent last, after the service has closed the connection.
constexpr std::chrono::seconds kMaxLinger{1};
/// Time for one call of a client that is denied.
constexpr std::chrono::seconds kMaxDenied{5};
/// Ahead of the threads of gRPC, if the system allows it.
constexpr int kNice = -5;

/// Limits of a console, which calls for many people, and bounds what each of them may.
AccountLimits of_console(AccountLimits limits) {
  constexpr int kPeople = 4;
  limits.max_calls *= kPeople;
  limits.max_resets_at_once *= kPeople;
  limits.max_resets_per_s *= kPeople;
  limits.max_controls_at_once *= kPeople;
  limits.max_controls_per_s *= kPeople;
  return limits;
}

/// "ipv4:192.168.1.7" of "ipv4:192.168.1.7:40712".
std::string host_of(const std::string& peer) {
  return peer.substr(0, peer.rfind(':'));
}

}  // namespace

ConnectionRelay::ConnectionRelay(Parts parts)
    : parts_(std::move(parts)),
      epoll_(epoll_create1(EPOLL_CLOEXEC)),
      wake_(eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK)) {
  epoll_event event{};
  event.events = EPOLLIN;
  epoll_ctl(epoll_, EPOLL_CTL_ADD, wake_, &event);
  thread_ = std::thread([this] { run(); });
}

ConnectionRelay::~ConnectionRelay() {
  {
    const MutexLock lock(mutex_);
    ending_ = true;
  }
  eventfd_write(wake_, 1);
  thread_.join();
  for (const Arrival& arrival : arrivals_) close(arrival.descriptor);
  connections_.clear();
  close(wake_);
  close(epoll_);
}

void ConnectionRelay::take(int descriptor, Identity who) {
  {
    const MutexLock lock(mutex_);
    arrivals_.push_back({descriptor, std::move(who)});
  }
  eventfd_write(wake_, 1);
}

bool ConnectionRelay::has_room() {
  const MutexLock lock(mutex_);
  return arrivals_.size() < kMaxArrivals;
}

void ConnectionRelay::run() {
  pthread_setname_np(pthread_self(), parts_.thread_name);
  setpriority(PRIO_PROCESS, static_cast<id_t>(gettid()), kNice);
  std::array<epoll_event, 64> events{};
  RelayedConnection::Buffer buffer{};
  auto look_at = Clock::now() + kLookInterval;
  for (;;) {
    const auto wait = std::chrono::ceil<std::chrono::milliseconds>(look_at - Clock::now());
    const int count = epoll_wait(epoll_, events.data(), static_cast<int>(events.size()),
                                 static_cast<int>(std::max<std::int64_t>(0, wait.count())));
    // A step of a handshake may take milliseconds: one a turn, of the one that epoll has kept waiting
    // longest.
    std::uint64_t handshake = 0;
    for (int i = 0; i < count; ++i) {
      const std::uint64_t number = events[static_cast<std::size_t>(i)].data.u64;
      const auto found = connections_.find(number);
      if (found == connections_.end() || found->second->is_ended) continue;
      if (found->second->state != RelayedConnection::State::kShakingHands) {
        serve(*found->second, buffer);
      } else if (handshake == 0) {
        handshake = number;
      }
    }
    if (const auto found = connections_.find(handshake);
        found != connections_.end() && !found->second->is_ended)
      serve(*found->second, buffer);
    {
      const MutexLock lock(mutex_);
      if (ending_) return;
    }
    take_arrivals();
    if (Clock::now() >= look_at) {
      end_overdue();
      look_at = Clock::now() + kLookInterval;
    }
    forget_ended();
  }
}

void ConnectionRelay::serve(RelayedConnection& connection, RelayedConnection::Buffer& buffer) {
  const Clock::time_point now = Clock::now();
  if (connection.state == RelayedConnection::State::kShakingHands) {
    const TlsSession::Step step = connection.tls->shake_hands();
    if (step == TlsSession::Step::kFailed) return part(connection, now);
    if (step == TlsSession::Step::kWants) return watch(connection);
    end_handshake(connection);
    const CertificateNames names = connection.tls->peer();
    const std::string peer = std::exchange(connection.who.peer, {});
    connection.who = parts_.policy.of_certificate(names.uri, names.serial);
    connection.who.peer = peer;
    admit(connection, now);
    if (connection.is_ended) return;
  }
  if (connection.state == RelayedConnection::State::kLingering) {
    const ssize_t size = recv(connection.client, buffer.data(), buffer.size(), 0);
    if (size == 0 || (size < 0 && errno != EAGAIN)) end(connection, {});
    return;
  }
  if (connection.name.empty()) {
    open_service(connection);
    if (connection.name.empty()) return;
  }
  const std::string_view problem = connection.pass_to_service(buffer, now);
  if (!problem.empty()) return end(connection, problem);
  if (!connection.pass_to_client(buffer)) return end(connection, {});
  const bool was_answered = connection.who.is_denied && connection.frames->calls_answered() > 0;
  if ((connection.service_left || was_answered) && connection.to_client.empty()) return part(connection, now);
  watch(connection);
}

void ConnectionRelay::take_arrivals() {
  eventfd_t unused = 0;
  eventfd_read(wake_, &unused);
  std::vector<Arrival> arrivals;
  {
    const MutexLock lock(mutex_);
    arrivals.swap(arrivals_);
  }
  for (Arrival& arrival : arrivals) begin(std::move(arrival));
}

void ConnectionRelay::begin(Arrival arrival) {
  const Clock::time_point now = Clock::now();
  const int descriptor = arrival.descriptor;
  auto made = std::make_unique<RelayedConnection>(++last_, descriptor, std::move(arrival.who));
  RelayedConnection& connection = *made;
  connections_.emplace(last_, std::move(made));
  connection.until = now + kMaxHandshake;
  if (!parts_.tls) return admit(connection, now);
  if (strangers_ >= kMaxStrangers) make_room_for_stranger();
  ++strangers_;
  connection.state = RelayedConnection::State::kShakingHands;
  connection.tls = parts_.tls->accept(descriptor);
  if (!connection.tls) return end(connection, "there is no memory for it");
  watch(connection);
}

void ConnectionRelay::admit(RelayedConnection& connection, Clock::time_point now) {
  const std::shared_ptr<Account> account = account_of(connection.who);
  if (!make_room(connection, *account)) return end(connection, "its client has too many connections");
  connection.account = account;
  ++account->connections;
  if (connection.who.is_denied) connection.until = now + kMaxDenied;
  connection.frames.emplace(*account);
  open_service(connection);
}

void ConnectionRelay::open_service(RelayedConnection& connection) {
  if (!connection.tls) {
    char first = 0;
    const ssize_t size = recv(connection.client, &first, sizeof first, MSG_PEEK);
    if (size < 0 && errno == EAGAIN) return watch(connection);
    if (size <= 0) return end(connection, {});
  }
  connection.name = parts_.table.add(connection.who);
  const int served = connection.open_inner(connection.name);
  if (served < 0) return end(connection, "no descriptors are left for it");
  parts_.serve(served);
  watch(connection);
}

std::shared_ptr<Account> ConnectionRelay::account_of(const Identity& who) {
  std::shared_ptr<Account>& account = accounts_[who.is_console ? "console " + who.name : who.name];
  if (!account)
    account = std::make_shared<Account>(who.is_console ? of_console(parts_.limits) : parts_.limits);
  return account;
}

bool ConnectionRelay::make_room(const RelayedConnection& newest, const Account& account) {
  if (newest.who.is_denied) return account.connections == 0;
  const int max = std::min(parts_.limits.max_connections, static_cast<int>(parts_.max_connections / 2));
  const Account* crowded = account.connections >= max ? &account : nullptr;
  if (crowded == nullptr && connections_.size() > parts_.max_connections) {
    for (const auto& [number, one] : connections_) {
      if (one->account && (crowded == nullptr || one->account->connections > crowded->connections))
        crowded = one->account.get();
    }
  }
  if (crowded == nullptr) return true;
  RelayedConnection* unused = nullptr;  // the oldest without a call; rather one that never had any
  for (const auto& [number, one] : connections_) {
    if (one->is_ended || one->account.get() != crowded || (one->frames && one->frames->calls() > 0)) continue;
    const bool never_called = !one->frames || one->frames->calls_begun() == 0;
    if (unused == nullptr || never_called) unused = one.get();
    if (never_called) break;
  }
  if (unused == nullptr) return false;
  end(*unused, "a newer one of its client took its place");
  forget_ended();
  return true;
}

void ConnectionRelay::make_room_for_stranger() {
  std::map<std::string, std::pair<std::size_t, RelayedConnection*>> by_host;  // how many, and the oldest
  std::pair<std::size_t, RelayedConnection*> most{0, nullptr};
  for (const auto& [number, one] : connections_) {
    if (one->is_ended || one->state != RelayedConnection::State::kShakingHands || !one->tls) continue;
    auto& [count, oldest] = by_host[host_of(one->who.peer)];
    if (++count == 1) oldest = one.get();
    if (count > most.first) most = {count, oldest};
  }
  if (most.second != nullptr) end(*most.second, "another stranger took its place");
}

void ConnectionRelay::watch(RelayedConnection& connection) {
  const auto set = [&](int descriptor, std::uint32_t& present, std::uint32_t wanted) {
    if (present == wanted || descriptor < 0) return;
    epoll_event event{};
    event.events = wanted;
    event.data.u64 = connection.number;
    // One that is watched for nothing would still report that it was hung up, again and again.
    const int change = wanted == 0 ? EPOLL_CTL_DEL : (present == 0 ? EPOLL_CTL_ADD : EPOLL_CTL_MOD);
    epoll_ctl(epoll_, change, descriptor, &event);
    present = wanted;
  };
  if (connection.state == RelayedConnection::State::kShakingHands) {
    return set(connection.client, connection.client_events,
               connection.tls->wants_write() ? EPOLLOUT : EPOLLIN);
  }
  if (connection.state == RelayedConnection::State::kLingering) {
    return set(connection.client, connection.client_events, EPOLLIN);
  }
  const bool reads_client =
      !connection.client_left && !connection.service_is_deaf && connection.to_service.empty();
  const bool reads_inner = !connection.service_left && connection.to_client.empty();
  set(connection.client, connection.client_events,
      (reads_client ? EPOLLIN : 0U) | (connection.to_client.empty() ? 0U : EPOLLOUT));
  set(connection.inner, connection.inner_events,
      (reads_inner ? EPOLLIN : 0U) | (connection.to_service.empty() ? 0U : EPOLLOUT));
}

// Parts from a client. If it were closed at once, bytes of the client that are still unread would have the
// kernel throw away what was sent to it last.
void ConnectionRelay::part(RelayedConnection& connection, Clock::time_point now) {
  if (connection.tls && connection.frames) connection.tls->end();
  end_handshake(connection);
  leave_service(connection, now);
  if (connection.client_left || ::shutdown(connection.client, SHUT_WR) != 0) return end(connection, {});
  connection.state = RelayedConnection::State::kLingering;
  connection.until = now + kMaxLinger;
  watch(connection);
}

void ConnectionRelay::end_handshake(RelayedConnection& connection) {
  if (connection.state != RelayedConnection::State::kShakingHands) return;
  connection.state = RelayedConnection::State::kPassing;
  --strangers_;
}

void ConnectionRelay::leave_service(RelayedConnection& connection, Clock::time_point now) {
  connection.close_inner();
  if (!connection.name.empty()) parts_.table.close(std::exchange(connection.name, {}), now);
}

void ConnectionRelay::end(RelayedConnection& connection, std::string_view why) {
  if (connection.is_ended) return;
  if (!why.empty()) note(connection, why);
  end_handshake(connection);
  leave_service(connection, Clock::now());
  connection.close_client();
  connection.is_ended = true;
  ended_.push_back(connection.number);
}

void ConnectionRelay::end_overdue() {
  const Clock::time_point now = Clock::now();
  for (const auto& [number, one] : connections_) {
    if (one->is_ended) continue;
    const bool has_begun = one->frames && one->frames->has_begun();
    if (has_begun && !one->client_left && !one->who.is_denied) one->until = Clock::time_point::max();
    if (now >= one->until) end(*one, {});
  }
  // One that has used up something must not have it again by connecting again.
  std::erase_if(accounts_, [now](const auto& entry) {
    Account& account = *entry.second;
    return account.connections == 0 && account.resets.is_full(now) && account.controls.is_full(now);
  });
}

void ConnectionRelay::forget_ended() {
  for (const std::uint64_t number : ended_) connections_.erase(number);
  ended_.clear();
}

/// Logs at most one line a second: clients must not fill the log.
void ConnectionRelay::note(const RelayedConnection& connection, std::string_view why) {
  const Clock::time_point now = Clock::now();
  if (now < next_note_) {
    ++unnoted_;
    return;
  }
  next_note_ = now + std::chrono::seconds(1);
  const std::string left_out = unnoted_ > 0 ? fmt::format(" (and {} more)", std::exchange(unnoted_, 0)) : "";
  log_warning(fmt::format(
      "the connection of {} was closed: {}{}",
      connection.who.name.empty() ? connection.who.peer : connection.who.name + " at " + connection.who.peer,
      why, left_out));
}

}  // namespace hapticd::server
