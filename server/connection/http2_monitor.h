#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <string>
#include <string_view>

#include "server/connection/account.h"

namespace hapticd::server {

/// Follows the frames of one HTTP/2 connection in both directions, without reading what is in them, and
/// counts what is under way on the account of the client. A header is passed on only when it is complete:
/// gRPC 1.51 reads an unfinished one from its beginning with every piece that comes (CVE-2023-33953), and
/// forgets nothing of calls that are opened and reset (CVE-2023-44487). RFC 9113 has the frames.
class Http2Monitor {
 public:
  /// A header with its continuations; gRPC itself takes 8 kB.
  static constexpr std::size_t kMaxHeader = std::size_t{16} << 10U;

  explicit Http2Monitor(Account& account) : account_(account) {}
  /// Takes off the account what was still under way.
  ~Http2Monitor();
  Http2Monitor(const Http2Monitor&) = delete;
  Http2Monitor& operator=(const Http2Monitor&) = delete;

  /// Bytes of the client, in pieces as they come. Appends to `onward` what the service may see. Returns what
  /// is wrong: then the connection must be closed; empty: nothing.
  std::string_view from_client(std::string_view bytes, std::string& onward, Allowance::Time now);
  /// Bytes of the service.
  void from_service(std::string_view bytes);

  /// True if the client has begun to speak HTTP/2.
  bool has_begun() const noexcept { return preface_seen_ == kPreface.size(); }
  std::size_t calls() const noexcept { return calls_.size(); }
  std::uint64_t calls_begun() const noexcept { return calls_begun_; }
  std::uint64_t calls_answered() const noexcept { return calls_answered_; }

 private:
  static constexpr std::string_view kPreface = "PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n";
  static constexpr std::size_t kFrameHeader = 9;

  /// One direction: the frame that is passing.
  struct Passing {
    std::array<char, kFrameHeader> header{};
    std::size_t header_size = 0;
    std::uint32_t left = 0;  ///< bytes of its payload that are still to come

    std::uint32_t length() const;
    std::uint8_t type() const { return static_cast<std::uint8_t>(header[3]); }
    std::uint8_t flags() const { return static_cast<std::uint8_t>(header[4]); }
    std::uint32_t stream() const;
    /// Takes bytes of the header; true when it is complete.
    bool take_header(std::string_view& bytes);
  };

  /// A call that is under way, and what gRPC may hold of its requests.
  struct Call {
    std::uint32_t bytes = 0;
    std::uint32_t pieces = 0;  ///< short frames of data
    std::uint32_t since = 0;   ///< bytes since the pieces were counted from 0
    std::array<char, 5> prefix{};
    std::size_t prefix_size = 0;
    std::uint32_t left_of_message = 0;

    /// Takes bytes of its requests; true if a message ends there.
    bool take(std::string_view bytes);
  };

  std::string_view begin_frame(Allowance::Time now);
  std::string_view begin_header(Allowance::Time now);
  std::string_view begin_data(Allowance::Time now);
  void pass_data(std::string_view payload);
  std::string_view note_reset(Allowance::Time now);
  std::string_view note_control(Allowance::Time now);
  void end_call(std::uint32_t stream);
  void allow_window_updates(std::uint32_t size);
  void release_held(std::string& onward);

  Account& account_;
  std::size_t preface_seen_ = 0;
  Passing from_client_;
  Passing from_service_;
  bool is_in_header_ = false;
  std::string held_;                     ///< a header that is not complete yet
  std::map<std::uint32_t, Call> calls_;  ///< by stream
  std::uint32_t last_stream_ = 0;
  /// What a client needs to begin and to stay is its connection's own: a flood by another connection of the
  /// same identity does not close it.
  Allowance controls_{16.0, 2.0};
  std::uint32_t window_updates_ = 0;  ///< that the client may still send for what it was sent
  std::uint64_t calls_begun_ = 0;
  std::uint64_t calls_answered_ = 0;
};

}  // namespace hapticd::server
