#include "server/stop/stop_listener.h"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <pthread.h>
#include <sched.h>
#include <sys/eventfd.h>
#include <sys/resource.h>
#include <sys/signalfd.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <utility>

#include "server/connection/fair_places.h"
#include "server/stop/stop_memory.h"
#include "server/stop/stop_message.h"

namespace hapticd::server {

namespace {

/// Time for a client to read its answer before the connection is closed.
constexpr std::chrono::milliseconds kMaxLinger{200};
/// Bytes that are read after the answer, so that the end of the connection does not overtake it.
constexpr std::size_t kMaxDiscarded = 4096;
/// Maximum number of one kind, before the others have their turn.
constexpr int kMaxInTurn = 256;
constexpr int kNice = -15;
constexpr int kRetryMs = 1;
constexpr std::uint64_t kUnknownUser = UINT64_MAX;

/// Raises the thread above all ordinary threads, so that it runs when gRPC's threads use all CPUs; far behind
/// the loop. If the system grants no real-time priority, at least above the ordinary threads of this process.
void raise_priority() {
  const sched_param priority{.sched_priority = sched_get_priority_min(SCHED_RR) + 1};
  if (pthread_setschedparam(pthread_self(), SCHED_RR, &priority) == 0) return;
  setpriority(PRIO_PROCESS, static_cast<id_t>(gettid()), kNice);
}

void write_peer(const sockaddr_storage& address, std::array<char, 64>& text) {
  std::array<char, INET6_ADDRSTRLEN> host{};
  const bool is_v4 = address.ss_family == AF_INET;
  const auto& v4 = reinterpret_cast<const sockaddr_in&>(address);
  const auto& v6 = reinterpret_cast<const sockaddr_in6&>(address);
  const void* bytes = is_v4 ? static_cast<const void*>(&v4.sin_addr) : &v6.sin6_addr;
  inet_ntop(address.ss_family, bytes, host.data(), host.size());
  std::snprintf(text.data(), text.size(), is_v4 ? "ipv4:%s:%u" : "ipv6:[%s]:%u", host.data(),
                static_cast<unsigned>(ntohs(is_v4 ? v4.sin_port : v6.sin6_port)));
}

bool is_waited_for(int listening) {
  pollfd watched{listening, POLLIN, 0};
  return poll(&watched, 1, 0) > 0;
}

}  // namespace

std::string_view to_text(StopPath path) {
  switch (path) {
    case StopPath::kSignal:
      return "a signal";
    case StopPath::kDatagram:
      return "the datagram socket";
    case StopPath::kLoopback:
      return "the stop port";
    case StopPath::kTls:
      return "the stop port with certificates";
  }
  return "";
}

StopListener::StopListener(Parts parts)
    : parts_(std::move(parts)), wake_(eventfd(0, EFD_CLOEXEC)), spare_(eventfd(0, EFD_CLOEXEC)) {
  watched_.reserve(3 + parts_.listening.size() + kMaxConnections);
  thread_ = std::thread([this] { run(); });
}

StopListener::~StopListener() {
  eventfd_write(wake_, 1);
  thread_.join();
  for (Connection& connection : connections_) release(connection);
  close(wake_);
  if (spare_ >= 0) close(spare_);
}

void StopListener::run() {
  pthread_setname_np(pthread_self(), parts_.thread_name);
  raise_priority();
  use_stop_memory();
  for (;;) {
    watched_.clear();
    watched_.push_back({wake_, POLLIN, 0});
    watched_.push_back({parts_.signals, POLLIN, 0});  // poll passes over -1
    watched_.push_back({parts_.datagram, POLLIN, 0});
    for (const int descriptor : parts_.listening) watched_.push_back({descriptor, POLLIN, 0});
    Clock::time_point next = Clock::time_point::max();
    for (const Connection& connection : connections_) {
      const bool writes = connection.tls && connection.is_shaking_hands && connection.tls->wants_write();
      watched_.push_back({connection.descriptor, static_cast<short>(writes ? POLLOUT : POLLIN), 0});
      if (connection.descriptor >= 0) next = std::min(next, connection.until);
    }
    int wait_ms = -1;
    if (next != Clock::time_point::max()) {
      const auto wait = std::chrono::ceil<std::chrono::milliseconds>(next - Clock::now());
      wait_ms = static_cast<int>(std::max<std::int64_t>(0, wait.count()));
    }
    if (poll(watched_.data(), watched_.size(), wait_ms) < 0 && errno != EINTR) continue;
    if (watched_[0].revents != 0) return;
    if (watched_[1].revents != 0) serve_signals();
    if (watched_[2].revents != 0) serve_datagrams();
    const std::size_t first = 3 + parts_.listening.size();
    // Those that are there before those that come: a flood of new ones must not overtake them.
    for (std::size_t i = 0; i < kMaxConnections; ++i) {
      Connection& connection = connections_[i];
      connection.has_come = connection.descriptor >= 0 && watched_[first + i].revents != 0;
      if (connection.has_come && !connection.is_shaking_hands) serve(connection);
    }
    take_one_step_of_a_handshake();
    for (std::size_t i = 0; i < parts_.listening.size(); ++i) {
      if (watched_[3 + i].revents != 0) accept_all(parts_.listening[i]);
    }
    if (spare_ < 0) spare_ = eventfd(0, EFD_CLOEXEC);
    const Clock::time_point now = Clock::now();
    for (Connection& connection : connections_) {
      if (connection.descriptor >= 0 && now >= connection.until) release(connection);
    }
  }
}

void StopListener::serve_signals() {
  signalfd_siginfo info{};
  while (read(parts_.signals, &info, sizeof info) == static_cast<ssize_t>(sizeof info)) {
    StopReport report;
    report.path = StopPath::kSignal;
    report.has_user = true;
    report.user = info.ssi_uid;
    report.process = static_cast<std::int32_t>(info.ssi_pid);
    stop_and_report(report);
  }
}

void StopListener::serve_datagrams() {
  for (int i = 0; i < kMaxInTurn; ++i) {
    std::array<char, 64> bytes{};
    sockaddr_storage from{};
    alignas(cmsghdr) std::array<char, CMSG_SPACE(sizeof(ucred))> control{};
    iovec part{bytes.data(), bytes.size()};
    msghdr message{};
    message.msg_name = &from;
    message.msg_namelen = sizeof from;
    message.msg_iov = &part;
    message.msg_iovlen = 1;
    message.msg_control = control.data();
    message.msg_controllen = control.size();
    const ssize_t size = recvmsg(parts_.datagram, &message, MSG_DONTWAIT | MSG_CMSG_CLOEXEC);
    if (size < 0) return;
    if (is_answer({bytes.data(), static_cast<std::size_t>(size)})) continue;
    StopReport report;
    report.path = StopPath::kDatagram;
    const cmsghdr* header = CMSG_FIRSTHDR(&message);
    if (header != nullptr && header->cmsg_level == SOL_SOCKET && header->cmsg_type == SCM_CREDENTIALS) {
      ucred sender{};
      std::memcpy(&sender, CMSG_DATA(header), sizeof sender);
      report.has_user = true;
      report.user = sender.uid;
      report.process = sender.pid;
    }
    report.was_refused =
        !parts_.rights.unix_user_may_stop(report.has_user ? std::optional(report.user) : std::nullopt);
    const StopAnswer answer = report.was_refused ? refused_answer() : stopped_answer(stop_and_report(report));
    if (report.was_refused) hand_on(report);
    if (message.msg_namelen > sizeof(sa_family_t)) {
      sendto(parts_.datagram, answer.data(), answer.size(), MSG_DONTWAIT | MSG_NOSIGNAL,
             reinterpret_cast<const sockaddr*>(&from), message.msg_namelen);
    }
  }
}

void StopListener::accept_all(int listening) {
  for (int i = 0; i < kMaxInTurn; ++i) {
    sockaddr_storage peer{};
    socklen_t length = sizeof peer;
    const int descriptor =
        accept4(listening, reinterpret_cast<sockaddr*>(&peer), &length, SOCK_CLOEXEC | SOCK_NONBLOCK);
    if (descriptor < 0) {
      if (errno == EINTR || errno == ECONNABORTED) continue;
      const bool none_left = errno == EMFILE || errno == ENFILE;  // also if no connection waits
      if (none_left && is_waited_for(listening) && free_descriptor()) continue;
      return;
    }
    StopReport report;
    report.path = parts_.tls != nullptr ? StopPath::kTls : StopPath::kLoopback;
    write_peer(peer, report.peer);
    std::optional<unsigned> user;
    if (parts_.tls == nullptr) user = lookup_.user_of_loopback_peer(descriptor);
    report.has_user = user.has_value();
    report.user = user.value_or(0);
    const std::uint64_t client =
        parts_.tls != nullptr ? client_of(peer) : (user ? std::uint64_t{*user} : kUnknownUser);
    Connection& connection = place_for(client);
    connection.descriptor = descriptor;
    connection.client = client;
    connection.begun = Clock::now();
    connection.until = connection.begun + kMaxWait;
    connection.report = report;
    connection.is_shaking_hands = parts_.tls != nullptr;
    if (connection.is_shaking_hands) continue;  // has its turn
    connection.may_stop = parts_.rights.user_may_stop(user);
    serve(connection);  // what it has to say may be there already
  }
}

// A step takes up to some milliseconds, as a stranger's certificates are decoded before they are judged:
// those that are there already, and those that come, are looked at in between.
void StopListener::take_one_step_of_a_handshake() {
  Connection* chosen = nullptr;
  std::size_t least = 0;
  for (Connection& one : connections_) {
    if (!one.has_come || one.descriptor < 0 || !one.is_shaking_hands) continue;
    const std::size_t count = count_of(connections_, one.client);
    const bool goes_first =
        chosen == nullptr || count < least || (count == least && one.begun > chosen->begun);
    if (!goes_first) continue;
    least = count;
    chosen = &one;
  }
  if (chosen == nullptr) return;
  if (!chosen->tls) chosen->tls = parts_.tls->accept(chosen->descriptor);
  if (!chosen->tls) return release(*chosen);
  serve(*chosen);
}

bool StopListener::free_descriptor() {
  if (Connection* most = oldest_of_most(connections_, std::nullopt)) {
    release(*most);
    return true;
  }
  if (spare_ >= 0) {
    close(std::exchange(spare_, -1));
    return true;
  }
  poll(nullptr, 0, kRetryMs);  // the connection waits in its queue
  return false;
}

StopListener::Connection& StopListener::place_for(std::uint64_t client) {
  for (Connection& one : connections_) {
    if (one.descriptor < 0) return one;
  }
  Connection& chosen = *oldest_of_most(connections_, client);
  release(chosen);
  return chosen;
}

void StopListener::serve(Connection& connection) {
  if (connection.is_shaking_hands) {
    const TlsSession::Step step = connection.tls->shake_hands();
    if (step == TlsSession::Step::kFailed) return release(connection);
    if (step == TlsSession::Step::kWants) return;
    connection.is_shaking_hands = false;
    // A client without TCP_NODELAY sends its words only when its last ones are acknowledged: not in 40 ms.
    const int at_once = 1;
    setsockopt(connection.descriptor, IPPROTO_TCP, TCP_QUICKACK, &at_once, sizeof at_once);
    const CertificateNames names = connection.tls->peer();
    connection.may_stop = parts_.rights.certificate_may_stop(names.uri, names.serial);
    std::snprintf(connection.report.name.data(), connection.report.name.size(), "%s", names.uri.c_str());
  }
  while (connection.descriptor >= 0) {
    std::array<char, 64> bytes{};
    ssize_t size = 0;
    if (connection.tls) {
      size = connection.tls->read(bytes.data(), bytes.size());
      if (size == 0) return;
    } else {
      size = recv(connection.descriptor, bytes.data(), bytes.size(), 0);
      if (size < 0 && (errno == EAGAIN || errno == EINTR)) return;
    }
    if (size <= 0) return release(connection);
    if (connection.is_answered) {
      connection.discarded += static_cast<std::size_t>(size);
      if (connection.discarded > kMaxDiscarded) return release(connection);
      continue;
    }
    const std::size_t taken = std::min(static_cast<std::size_t>(size), kStopWord.size() - connection.size);
    std::copy_n(bytes.begin(), taken,
                connection.bytes.begin() + static_cast<std::ptrdiff_t>(connection.size));
    connection.size += taken;
    const std::string_view said(connection.bytes.data(), connection.size);
    if (!kStopWord.starts_with(said)) {
      answer(connection, false);
    } else if (said.size() == kStopWord.size()) {
      answer(connection, true);
    }
  }
}

void StopListener::answer(Connection& connection, bool is_stop) {
  StopReport& report = connection.report;
  report.was_refused = !is_stop || !connection.may_stop;
  const StopAnswer words = report.was_refused ? refused_answer() : stopped_answer(stop_and_report(report));
  if (report.was_refused) hand_on(report);
  // So few bytes find room in a connection that has sent nothing before.
  if (connection.tls) {
    connection.tls->write({words.data(), words.size()});
    connection.tls->end();
  } else {
    send(connection.descriptor, words.data(), words.size(), MSG_NOSIGNAL);
  }
  ::shutdown(connection.descriptor, SHUT_WR);
  connection.is_answered = true;
  connection.until = Clock::now() + kMaxLinger;
}

void StopListener::release(Connection& connection) {
  if (connection.descriptor < 0) return;
  connection.tls.reset();
  close(connection.descriptor);
  connection = Connection{};
}

std::uint64_t StopListener::stop_and_report(StopReport report) {
  report.last_tick = parts_.stop();
  hand_on(report);
  return report.last_tick;
}

void StopListener::hand_on(StopReport report) noexcept {
  report.unix_ns = std::chrono::duration_cast<std::chrono::nanoseconds>(
                       std::chrono::system_clock::now().time_since_epoch())
                       .count();
  if (!reports_.push(report)) lost_.fetch_add(1);
  eventfd_write(parts_.reported, 1);
}

}  // namespace hapticd::server
