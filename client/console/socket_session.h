#pragma once

#include <boost/asio/steady_timer.hpp>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <string_view>
#include <vector>

#include "client/console/console_shared.h"
#include "client/console/socket/web_socket.h"

namespace hapticd::console {

/// The live connection of a page. docs/console.md has its messages. What it holds for a page that reads
/// slowly is bounded: streams send no more than the page has granted. Used by the console's thread alone.
class SocketSession : public std::enable_shared_from_this<SocketSession> {
 public:
  using Request = WebSocket::Request;
  /// Takes over a connection whose request asks for it.
  static void begin(Transport transport, Request request, std::shared_ptr<ConsoleShared> shared,
                    Caller caller);
  ~SocketSession();
  SocketSession(const SocketSession&) = delete;
  SocketSession& operator=(const SocketSession&) = delete;

  /// Ends because the daemon does not answer: the page tries again.
  void end_for_loss();
  /// Ends the session because another identity needs the place.
  void end_for_others();
  /// Ends the session because pages that read slowly hold too much, and this one most.
  void end_for_slowness();
  /// Sends what a tap has credits for. ConsoleShared calls it in its turn.
  void send_rows(std::uint64_t id);
  bool is_over() const { return is_over_; }
  std::size_t queued_bytes() const { return queued_bytes_; }
  const std::string& identity() const { return caller_.name; }

 private:
  struct Open {
    std::shared_ptr<RpcStream> stream;
    std::uint64_t held = 0;  ///< credits that wait for the queue to empty
  };
  struct Tap {
    std::shared_ptr<TelemetryFeed> feed;
    std::uint64_t listener = 0;
    std::vector<std::string> names;  ///< empty: all columns
    std::size_t max_rows = 0;
    std::uint64_t credits = 0;
    bool is_announced = false;
    bool is_due = false;  ///< waits for its turn
    std::uint64_t lost_before = 0;
    RowReader reader;
  };
  struct Message {
    bool is_text;
    std::string bytes;
  };

  SocketSession(Transport transport, std::shared_ptr<ConsoleShared> shared, Caller caller);
  void accept(Request request);
  void read();
  void beat();
  void end(WebSocket::CloseCode code, const std::string& why);
  /// False if the message breaks the rules: the connection ends.
  bool take(std::string_view text);
  bool open_stream(const nlohmann::json& message);
  bool open_telemetry(const nlohmann::json& message);
  bool grant(const nlohmann::json& message);
  bool close_stream(const nlohmann::json& message);
  bool announce(std::uint64_t id, Tap& tap);
  void feed_changed(std::uint64_t id);
  void end_stream(std::uint64_t id, const RpcEnd& end);
  void send(bool is_text, std::string bytes);
  void write_next();
  void note_queued(std::ptrdiff_t bytes);
  bool is_taken(std::uint64_t id) const { return streams_.contains(id) || taps_.contains(id); }

  WebSocket socket_;
  const std::shared_ptr<ConsoleShared> shared_;
  const Caller caller_;
  boost::asio::steady_timer timer_;
  RequestRate rate_{1000.0};
  std::map<std::uint64_t, Open> streams_;
  std::map<std::uint64_t, Tap> taps_;
  std::deque<Message> queue_;
  std::size_t queued_bytes_ = 0;
  std::uint64_t beats_ = 0;
  bool is_writing_ = false;
  bool is_over_ = false;
};

}  // namespace hapticd::console
