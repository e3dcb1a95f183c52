#include "hal/modbus/tcp_exchange.h"

#include <modbus.h>
#include <poll.h>
#include <sys/socket.h>

#include <array>
#include <cerrno>

namespace hapticd::modbus {

namespace {

constexpr std::size_t kBeforeLength = 6;  // transaction, protocol, length
constexpr std::size_t kHeader = 7;        // and the unit
constexpr unsigned kMaxLength = 254;      // the unit, the function and 252 bytes

std::uint8_t high(unsigned number) {
  return static_cast<std::uint8_t>(number >> 8U);
}
std::uint8_t low(unsigned number) {
  return static_cast<std::uint8_t>(number);
}

/// 0 once the socket is ready, ETIMEDOUT, or the errno.
int wait_for(int socket, short events, std::chrono::steady_clock::time_point deadline) {
  for (;;) {
    const auto left =
        std::chrono::ceil<std::chrono::milliseconds>(deadline - std::chrono::steady_clock::now());
    if (left.count() <= 0) return ETIMEDOUT;
    pollfd one{socket, events, 0};
    const int ready = poll(&one, 1, static_cast<int>(left.count()));
    if (ready > 0) return 0;
    if (ready < 0 && errno != EINTR) return errno;
  }
}

bool is_later(int error) {
  return error == EAGAIN || error == EINTR;
}

}  // namespace

int TcpExchange::send(int socket, const Bytes& frame, Clock::time_point deadline) const {
  for (std::size_t sent = 0; sent < frame.size();) {
    const ssize_t count =
        ::send(socket, frame.data() + sent, frame.size() - sent, MSG_DONTWAIT | MSG_NOSIGNAL);
    if (count >= 0) {
      sent += static_cast<std::size_t>(count);
      continue;
    }
    if (!is_later(errno)) return errno;
    // Half a request cannot be taken back: the connection is of no more use.
    if (const int error = wait_for(socket, POLLOUT, deadline)) return sent > 0 ? ECONNRESET : error;
  }
  return 0;
}

int TcpExchange::receive(int socket, Clock::time_point deadline) {
  if (const int error = wait_for(socket, POLLIN, deadline)) return error;
  std::array<std::uint8_t, 512> bytes{};
  const ssize_t count = recv(socket, bytes.data(), bytes.size(), MSG_DONTWAIT);
  if (count == 0) return ECONNRESET;
  if (count < 0) return is_later(errno) ? 0 : errno;
  received_.insert(received_.end(), bytes.begin(), bytes.begin() + count);
  return 0;
}

int TcpExchange::discard_all(int socket) {
  received_.clear();
  std::array<std::uint8_t, 512> bytes{};
  while (recv(socket, bytes.data(), bytes.size(), MSG_DONTWAIT) > 0) {
  }
  return EMBBADDATA;
}

int TcpExchange::exchange(int socket, int unit, const Bytes& request, double timeout_s, Bytes& answer) {
  const auto deadline =
      Clock::now() + std::chrono::ceil<Clock::duration>(std::chrono::duration<double>(timeout_s));
  ++transaction_;
  const auto size = static_cast<unsigned>(request.size()) + 1U;
  Bytes frame{
      high(transaction_), low(transaction_), 0, 0, high(size), low(size), static_cast<std::uint8_t>(unit)};
  frame.insert(frame.end(), request.begin(), request.end());
  if (const int error = send(socket, frame, deadline)) return error;
  for (;;) {
    while (received_.size() >= kHeader) {
      const unsigned length = received_[4] * 256U + received_[5];
      if (received_[2] != 0 || received_[3] != 0 || length < 2 || length > kMaxLength)
        return discard_all(socket);
      if (received_.size() < kBeforeLength + length) break;
      const auto number = static_cast<std::uint16_t>(received_[0] * 256U + received_[1]);
      const auto end = received_.begin() + static_cast<std::ptrdiff_t>(kBeforeLength + length);
      answer.assign(received_.begin() + kHeader, end);
      received_.erase(received_.begin(), end);
      if (number == transaction_) return 0;
      // Numbers wrap round: half of them are earlier ones.
      if (static_cast<std::int16_t>(number - transaction_) > 0) return discard_all(socket);
      ++late_answers_;
    }
    if (const int error = receive(socket, deadline)) return error;
  }
}

}  // namespace hapticd::modbus
