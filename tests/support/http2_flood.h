#pragma once

#include <string>

namespace hapticd::test {

/// A client that speaks HTTP/2 by hand and resets each stream as soon as it is opened ("rapid reset"), as no
/// library does. One connection.
class Http2Flood {
 public:
  /// `address`: "127.0.0.1:PORT". Throws where no one listens.
  explicit Http2Flood(const std::string& address);
  ~Http2Flood();
  Http2Flood(const Http2Flood&) = delete;
  Http2Flood& operator=(const Http2Flood&) = delete;

  /// Opens and resets so many streams of a unary or server-streaming method, each with an empty request.
  /// Returns how many were sent before the service closed the connection.
  int open_and_reset(const std::string& method, int streams);

 private:
  bool send_all(const std::string& bytes);
  void discard_what_came();

  int socket_ = -1;
  unsigned next_stream_ = 1;
  std::string authority_;
};

}  // namespace hapticd::test
