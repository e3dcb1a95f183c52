#include "client/console/socket_session.h"

#include <fmt/format.h>
#include <google/protobuf/descriptor.h>

#include <algorithm>
#include <chrono>
#include <nlohmann/json.hpp>
#include <utility>

#include "proto/text/json_depth.h"

namespace hapticd::console {

using nlohmann::json;

namespace {

constexpr std::size_t kMaxMessage = 64U << 10U;
constexpr std::size_t kMaxStreams = 24;
constexpr std::size_t kMaxTaps = 4;
constexpr std::uint64_t kMaxCredits = 1000;
constexpr std::uint64_t kMaxTapCredits = 4;
constexpr std::size_t kMaxColumns = 256;
/// Numbers in a message of rows; what would be more comes in pairs of rows.
constexpr std::size_t kMaxCells = 65'536;
/// Bytes above which streams wait; far above it the connection ends.
constexpr std::size_t kBusyBytes = 1U << 20U;
constexpr std::size_t kMaxQueuedBytes = 16U << 20U;
constexpr std::size_t kMaxQueued = 4096;
constexpr std::chrono::milliseconds kBeat{500};
constexpr unsigned kUnavailable = 503;

std::uint64_t number_in(const json& message, const char* key, std::uint64_t otherwise) {
  const auto found = message.find(key);
  return found != message.end() && found->is_number_unsigned() ? found->get<std::uint64_t>() : otherwise;
}

std::string text_in(const json& message, const char* key) {
  const auto found = message.find(key);
  return found != message.end() && found->is_string() ? found->get<std::string>() : std::string();
}

}  // namespace

void SocketSession::begin(Transport transport, Request request, std::shared_ptr<ConsoleShared> shared,
                          Caller caller) {
  std::shared_ptr<SocketSession> session(
      new SocketSession(std::move(transport), std::move(shared), std::move(caller)));
  session->shared_->sockets.push_back(session);
  session->accept(std::move(request));
}

SocketSession::SocketSession(Transport transport, std::shared_ptr<ConsoleShared> shared, Caller caller)
    : socket_(std::move(transport), kMaxMessage),
      shared_(std::move(shared)),
      caller_(std::move(caller)),
      timer_(socket_.executor()) {}

SocketSession::~SocketSession() {
  for (auto& [id, open] : streams_) {
    if (open.stream) open.stream->cancel();
  }
  for (auto& [id, tap] : taps_) tap.feed->forget(tap.listener);
  shared_->queued_bytes -= queued_bytes_;
}

void SocketSession::accept(Request request) {
  socket_.accept(std::move(request), [self = shared_from_this()](bool is_good) {
    if (!is_good) return;
    self->read();
    self->beat();
  });
}

void SocketSession::read() {
  socket_.read([self = shared_from_this()](bool is_good, bool is_text, std::string_view message) {
    if (!is_good || self->is_over_) {
      self->is_over_ = true;
      self->timer_.cancel();
      return;
    }
    if (!self->rate_.take(std::chrono::steady_clock::now())) {
      return self->end(WebSocket::CloseCode::policy_error, "too many messages");
    }
    if (!is_text || !self->take(message)) {
      return self->end(WebSocket::CloseCode::policy_error, "not a message of this protocol");
    }
    self->read();
  });
}

// A page that hears nothing for longer shows it.
void SocketSession::beat() {
  if (is_over_) return;
  if (queue_.empty()) send(true, fmt::format("{{\"beat\":{}}}", ++beats_));
  timer_.expires_after(kBeat);
  timer_.async_wait([weak = weak_from_this()](boost::beast::error_code error) {
    if (const auto self = weak.lock(); self && !error) self->beat();
  });
}

void SocketSession::end(WebSocket::CloseCode code, const std::string& why) {
  if (is_over_) return;
  is_over_ = true;
  timer_.cancel();
  while (queue_.size() > (is_writing_ ? 1U : 0U)) {
    note_queued(-static_cast<std::ptrdiff_t>(queue_.back().bytes.size()));
    queue_.pop_back();
  }
  socket_.close(code, why, [self = shared_from_this()] {});
}

void SocketSession::note_queued(std::ptrdiff_t bytes) {
  queued_bytes_ += static_cast<std::size_t>(bytes);
  shared_->queued_bytes += static_cast<std::size_t>(bytes);
}

void SocketSession::end_for_slowness() {
  end(WebSocket::CloseCode::policy_error, "the page reads too slowly");
}

void SocketSession::end_for_loss() {
  end(WebSocket::CloseCode::try_again_later, "the daemon does not answer");
}

void SocketSession::end_for_others() {
  end(WebSocket::CloseCode::try_again_later, "others need a place for their pages: max_sockets");
}

bool SocketSession::take(std::string_view text) {
  if (!text::is_shallow_json(text)) return false;
  const json message = json::parse(text, nullptr, false);
  if (!message.is_object()) return false;
  if (message.contains("credit")) return grant(message);
  if (message.contains("open")) return open_stream(message);
  if (message.contains("telemetry")) return open_telemetry(message);
  if (message.contains("close")) return close_stream(message);
  return false;
}

bool SocketSession::open_stream(const json& message) {
  const std::uint64_t id = number_in(message, "open", 0);
  if (id == 0 || is_taken(id) || streams_.size() >= kMaxStreams) return false;
  const std::string method = text_in(message, "method");
  Caller caller = caller_;
  caller.lease = text_in(message, "lease");
  const auto request = message.find("request");
  const std::string request_json = request == message.end() ? "{}" : request->dump();
  const auto* contract = RpcBridge::find(method);
  streams_[id] = {};
  const std::weak_ptr<SocketSession> weak = weak_from_this();
  auto stream = shared_->bridge.open(
      method, request_json, caller,
      [weak, id, contract, post = shared_->post](const std::string& bytes) {
        std::string answer = fmt::format("{{\"id\":{},\"message\":{}}}", id,
                                         RpcBridge::to_json(*contract->output_type(), bytes));
        post([weak, id, answer = std::move(answer)]() mutable {
          const auto self = weak.lock();
          if (self && self->streams_.contains(id)) self->send(true, std::move(answer));
        });
      },
      [weak, id, post = shared_->post](RpcEnd end) {
        post([weak, id, end = std::move(end)] {
          if (const auto self = weak.lock()) self->end_stream(id, end);
        });
      });
  if (!stream) return true;  // its end is on the way
  streams_[id].stream = stream;
  stream->grant(std::clamp<std::uint64_t>(number_in(message, "credits", 8), 1, kMaxCredits));
  return true;
}

bool SocketSession::open_telemetry(const json& message) {
  const std::uint64_t id = number_in(message, "telemetry", 0);
  if (id == 0 || is_taken(id) || taps_.size() >= kMaxTaps) return false;
  Tap tap;
  tap.max_rows =
      static_cast<std::size_t>(std::clamp<std::uint64_t>(number_in(message, "max_rows", 512), 2, 8192));
  tap.credits = std::min(number_in(message, "credits", 2), kMaxTapCredits);
  if (const auto columns = message.find("columns"); columns != message.end()) {
    if (!columns->is_array() || columns->size() > kMaxColumns) return false;
    for (const json& name : *columns) {
      if (!name.is_string()) return false;
      tap.names.push_back(name.get<std::string>());
    }
  }
  tap.feed = shared_->feed_of(caller_);
  tap.listener = tap.feed->on_change([weak = weak_from_this(), id] {
    if (const auto self = weak.lock()) self->feed_changed(id);
  });
  taps_[id] = std::move(tap);
  feed_changed(id);
  return true;
}

bool SocketSession::grant(const json& message) {
  const std::uint64_t id = number_in(message, "credit", 0);
  const std::uint64_t count = std::min(number_in(message, "n", 1), kMaxCredits);
  if (const auto tap = taps_.find(id); tap != taps_.end()) {
    tap->second.credits = std::min(tap->second.credits + count, kMaxTapCredits);
    feed_changed(id);
    return true;
  }
  const auto open = streams_.find(id);
  if (open == streams_.end() || !open->second.stream) return true;  // over already
  if (queued_bytes_ > kBusyBytes) {
    open->second.held += count;
  } else {
    open->second.stream->grant(count);
  }
  return true;
}

bool SocketSession::close_stream(const json& message) {
  const std::uint64_t id = number_in(message, "close", 0);
  if (const auto tap = taps_.find(id); tap != taps_.end()) {
    tap->second.feed->forget(tap->second.listener);
    taps_.erase(tap);
    return true;
  }
  const auto open = streams_.find(id);
  if (open == streams_.end()) return true;
  if (open->second.stream) open->second.stream->cancel();
  return true;  // goes when its end comes
}

/// Finds the columns; false if one is not there.
bool SocketSession::announce(std::uint64_t id, Tap& tap) {
  const auto& columns = tap.feed->columns();
  json list = json::array();
  const auto add = [&](std::size_t index) {
    tap.reader.columns.push_back(index);
    list.push_back({{"name", columns[index].name}, {"unit", columns[index].unit}});
  };
  if (tap.names.empty()) {
    for (std::size_t i = 0; i < columns.size(); ++i) add(i);
  }
  for (const std::string& name : tap.names) {
    const auto found = std::find_if(columns.begin(), columns.end(),
                                    [&](const FeedColumn& column) { return column.name == name; });
    if (found == columns.end()) {
      end_stream(id, refuse_rpc(grpc::StatusCode::INVALID_ARGUMENT,
                                detail_of("the telemetry has no such column", "columns", name, "",
                                          "leave columns out to see all of them")));
      return false;
    }
    add(static_cast<std::size_t>(found - columns.begin()));
  }
  const std::size_t width = std::max<std::size_t>(tap.reader.columns.size(), 1);
  tap.max_rows = std::min(tap.max_rows, kMaxCells / width);
  tap.reader.next = tap.feed->ring()->end();
  tap.lost_before = tap.feed->lost();
  tap.is_announced = true;
  send(true, json{{"id", id}, {"columns", list}, {"rate_hz", tap.feed->rate_hz()}}.dump());
  return true;
}

void SocketSession::feed_changed(std::uint64_t id) {
  const auto found = taps_.find(id);
  if (found == taps_.end() || is_over_) return;
  Tap& tap = found->second;
  if (tap.feed->end()) return end_stream(id, *tap.feed->end());
  const RowRing* ring = tap.feed->ring();
  if (ring == nullptr || (!tap.is_announced && !announce(id, tap))) return;
  if (tap.is_due || tap.credits == 0 || ring->end() == tap.reader.next) return;
  tap.is_due = true;
  shared_->due_rows.emplace_back(weak_from_this(), id);
}

void SocketSession::send_rows(std::uint64_t id) {
  const auto found = taps_.find(id);
  if (found == taps_.end() || is_over_) return;
  Tap& tap = found->second;
  tap.is_due = false;
  const RowRing* ring = tap.feed->ring();
  // A page that does not read gets what there is when it does.
  const bool waits = !tap.is_announced || tap.credits == 0 || queued_bytes_ > kBusyBytes;
  if (waits || ring == nullptr || ring->end() == tap.reader.next) return;
  --tap.credits;
  std::vector<double> rows = read_rows(*ring, tap.reader, static_cast<double>(id), tap.max_rows);
  rows[3] += static_cast<double>(tap.feed->lost() - tap.lost_before);
  send(false, {reinterpret_cast<const char*>(rows.data()), rows.size() * sizeof(double)});
}

void SocketSession::end_stream(std::uint64_t id, const RpcEnd& end) {
  if (end.http_status == kUnavailable) shared_->watch->look();
  if (const auto tap = taps_.find(id); tap != taps_.end()) {
    tap->second.feed->forget(tap->second.listener);
    taps_.erase(tap);
  }
  streams_.erase(id);
  send(true, fmt::format("{{\"id\":{},\"end\":{}}}", id, end.json));
}

void SocketSession::send(bool is_text, std::string bytes) {
  if (is_over_) return;
  note_queued(static_cast<std::ptrdiff_t>(bytes.size()));
  queue_.push_back({is_text, std::move(bytes)});
  if (queued_bytes_ > kMaxQueuedBytes || queue_.size() > kMaxQueued) return end_for_slowness();
  shared_->limit_queued();
  write_next();
}

void SocketSession::write_next() {
  if (is_writing_ || queue_.empty() || is_over_) return;
  is_writing_ = true;
  const Message& next = queue_.front();
  socket_.write(next.is_text, next.bytes, [self = shared_from_this()](bool is_good) {
    self->is_writing_ = false;
    if (!is_good) {
      self->is_over_ = true;
      self->timer_.cancel();
      return;
    }
    self->note_queued(-static_cast<std::ptrdiff_t>(self->queue_.front().bytes.size()));
    self->queue_.pop_front();
    if (self->queued_bytes_ <= kBusyBytes) {
      for (auto& [id, open] : self->streams_) {
        if (open.held == 0 || !open.stream) continue;
        open.stream->grant(open.held);
        open.held = 0;
      }
    }
    self->write_next();
  });
}

}  // namespace hapticd::console
