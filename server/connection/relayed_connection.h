#pragma once

#include <sys/types.h>

#include <array>
#include <chrono>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

#include "server/access/identity.h"
#include "server/connection/account.h"
#include "server/connection/http2_monitor.h"
#include "server/connection/tls_server.h"

namespace hapticd::server {

/// Bytes on their way to a descriptor.
class Outgoing {
 public:
  bool empty() const { return sent_ == bytes_.size(); }
  std::string& bytes() { return bytes_; }
  std::string_view left() const { return std::string_view(bytes_).substr(sent_); }
  void note_sent(std::size_t count) {
    sent_ += count;
    if (!empty()) return;
    bytes_.clear();
    sent_ = 0;
    if (bytes_.capacity() > kMaxKept) bytes_.shrink_to_fit();
  }

 private:
  static constexpr std::size_t kMaxKept = 65'536;
  std::string bytes_;
  std::size_t sent_ = 0;
};

/// One connection of a relay: the client's end, the end towards the service, and what is on its way between.
/// One thread.
class RelayedConnection {
 public:
  enum class State { kShakingHands, kPassing, kLingering };

  using Clock = std::chrono::steady_clock;
  using Buffer = std::array<char, 16'384>;  ///< a record of TLS is no longer

  RelayedConnection(std::uint64_t its_number, int descriptor, Identity its_client)
      : number(its_number), who(std::move(its_client)), client(descriptor) {}
  ~RelayedConnection();
  RelayedConnection(const RelayedConnection&) = delete;
  RelayedConnection& operator=(const RelayedConnection&) = delete;

  /// Makes the end towards the service; returns the one that the service gets, -1 if the system refuses it.
  int open_inner(const std::string& its_name);
  void close_inner();
  void close_client();
  /// Passes bytes on; returns what is wrong, empty: nothing.
  std::string_view pass_to_service(Buffer& buffer, Clock::time_point now);
  /// False when the client is gone.
  bool pass_to_client(Buffer& buffer);

  const std::uint64_t number;
  Identity who;
  int client;
  int inner = -1;
  Clock::time_point until = Clock::time_point::max();  ///< then it is closed
  State state = State::kPassing;
  bool is_ended = false;
  bool client_left = false;
  bool service_is_deaf = false;  ///< takes no more, but may still have something to send
  bool service_left = false;
  std::unique_ptr<TlsSession> tls;
  std::string name;                  ///< of the inner end
  std::shared_ptr<Account> account;  ///< null before its client is known
  std::optional<Http2Monitor> frames;
  Outgoing to_service;
  Outgoing to_client;
  std::uint32_t client_events = 0;  ///< that are watched
  std::uint32_t inner_events = 0;

 private:
  ssize_t read_client(Buffer& buffer);
  ssize_t write_client(std::string_view bytes);
};

}  // namespace hapticd::server
