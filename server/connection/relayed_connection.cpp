#include "server/connection/relayed_connection.h"

#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <cerrno>
#include <cstddef>
#include <cstring>

namespace hapticd::server {

namespace {

/// Maximum number of reads of one connection before the others have their turn.
constexpr int kReadsInTurn = 4;
/// Time for the service to close a connection that its client has left.
constexpr std::chrono::seconds kMaxLeaving{10};

/// Gives an end of a pair of sockets a name that its other end sees.
bool name_end(int descriptor, std::string_view name) {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  if (name.size() + 1 > sizeof address.sun_path) return false;
  std::memcpy(address.sun_path + 1, name.data(), name.size());
  const std::size_t length = offsetof(sockaddr_un, sun_path) + 1 + name.size();
  return bind(descriptor, reinterpret_cast<const sockaddr*>(&address), static_cast<socklen_t>(length)) == 0;
}

void close_if_open(int& descriptor) {
  if (descriptor >= 0) close(std::exchange(descriptor, -1));
}

/// Bytes; 0: not now; -1: over.
ssize_t outcome(ssize_t result, bool zero_is_the_end) {
  if (result > 0) return result;
  if (result == 0) return zero_is_the_end ? -1 : 0;
  return errno == EAGAIN || errno == EWOULDBLOCK || errno == EINTR ? 0 : -1;
}

}  // namespace

RelayedConnection::~RelayedConnection() {
  close_client();
  close_inner();
  if (account) --account->connections;
}

int RelayedConnection::open_inner(const std::string& its_name) {
  int pair[2];
  if (socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0, pair) != 0) return -1;
  inner = pair[0];
  if (name_end(inner, its_name)) return pair[1];
  close(pair[1]);
  return -1;
}

void RelayedConnection::close_inner() {
  frames.reset();
  close_if_open(inner);
}

void RelayedConnection::close_client() {
  tls.reset();
  close_if_open(client);
}

ssize_t RelayedConnection::read_client(Buffer& buffer) {
  return tls ? tls->read(buffer.data(), buffer.size())
             : outcome(recv(client, buffer.data(), buffer.size(), 0), true);
}

ssize_t RelayedConnection::write_client(std::string_view bytes) {
  return tls ? tls->write(bytes) : outcome(send(client, bytes.data(), bytes.size(), MSG_NOSIGNAL), false);
}

std::string_view RelayedConnection::pass_to_service(Buffer& buffer, Clock::time_point now) {
  for (int turn = 0; turn <= kReadsInTurn; ++turn) {
    while (!to_service.empty()) {
      const ssize_t sent =
          outcome(send(inner, to_service.left().data(), to_service.left().size(), MSG_NOSIGNAL), false);
      if (sent == 0) return {};
      if (sent < 0) service_is_deaf = true;
      to_service.note_sent(sent < 0 ? to_service.left().size() : static_cast<std::size_t>(sent));
    }
    if (client_left || service_is_deaf || turn == kReadsInTurn) break;
    const ssize_t size = read_client(buffer);
    if (size == 0) break;
    if (size < 0) {
      client_left = true;
      until = now + kMaxLeaving;
      break;
    }
    const std::string_view came(buffer.data(), static_cast<std::size_t>(size));
    if (const std::string_view problem = frames->from_client(came, to_service.bytes(), now);
        !problem.empty()) {
      return problem;
    }
    if (who.is_denied && frames->calls_begun() > 1) return "it is denied";
  }
  if (client_left && to_service.empty()) shutdown(inner, SHUT_WR);
  return {};
}

bool RelayedConnection::pass_to_client(Buffer& buffer) {
  for (int turn = 0; turn <= kReadsInTurn; ++turn) {
    while (!to_client.empty()) {
      const ssize_t sent = write_client(to_client.left());
      if (sent < 0) return false;
      if (sent == 0) return true;
      to_client.note_sent(static_cast<std::size_t>(sent));
    }
    if (service_left || turn == kReadsInTurn) break;
    const ssize_t size = outcome(recv(inner, buffer.data(), buffer.size(), 0), true);
    if (size == 0) break;
    if (size < 0) {
      service_left = true;
      break;
    }
    const std::string_view came(buffer.data(), static_cast<std::size_t>(size));
    frames->from_service(came);
    to_client.bytes() += came;
  }
  return true;
}

}  // namespace hapticd::server
