#pragma once

#include <openssl/types.h>

#include <string>

namespace hapticd::test {

/// A client that speaks HTTP/2 by hand, as no library does. One connection.
class Http2Flood {
 public:
  /// `address`: "127.0.0.1:PORT", "unix:/path", or "tls:127.0.0.1:PORT" with a folder of client.crt,
  /// client.key and authority.crt. Throws if nothing listens.
  explicit Http2Flood(const std::string& address, const std::string& certificates = {});
  ~Http2Flood();
  Http2Flood(const Http2Flood&) = delete;
  Http2Flood& operator=(const Http2Flood&) = delete;

  /// Opens and resets so many streams of a unary or server-streaming method, each with an empty request
  /// ("rapid reset"). Returns how many were sent before the service closed the connection.
  int open_and_reset(const std::string& method, int streams);
  /// Sends one header that never ends: a text that claims to have a gigabyte, in continuations of 16 kB.
  /// Returns how many bytes were sent before the service closed the connection.
  long send_endless_header(long bytes);
  /// Opens so many calls and leaves their requests of `bytes` each without an end. Returns how many.
  int open_unfinished(const std::string& method, int calls, int bytes);
  /// Makes so many calls and lets no byte of their answers come: their windows are 0. `request`: a message.
  /// `is_finished`: no other request follows. Returns how many.
  int open_unread(const std::string& method, int calls, const std::string& request = {},
                  bool is_finished = true);
  /// The service has closed the connection.
  bool is_closed();

 private:
  void connect_to(const std::string& address);
  void begin_tls(const std::string& certificates);
  std::string headers_of(const std::string& method) const;
  bool send_all(const std::string& bytes);
  void discard_what_came();

  int socket_ = -1;
  SSL_CTX* context_ = nullptr;
  SSL* tls_ = nullptr;
  bool is_closed_ = false;
  unsigned next_stream_ = 1;
  std::string authority_;
};

}  // namespace hapticd::test
