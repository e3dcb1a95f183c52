#include "server/connection/http2_monitor.h"

#include <algorithm>
#include <utility>

namespace hapticd::server {

namespace {

enum FrameType : std::uint8_t {
  kData = 0,
  kHeaders = 1,
  kReset = 3,
  kSettings = 4,
  kPushPromise = 5,
  kPing = 6,
  kGoAway = 7,
  kWindowUpdate = 8,
  kContinuation = 9,
};
constexpr std::uint8_t kEndStream = 0x1;
constexpr std::uint8_t kAcknowledged = 0x1;
constexpr std::uint8_t kEndHeaders = 0x4;
/// No frame but data needs more.
constexpr std::uint32_t kMaxControl = 16'384;
/// A request is counted up to this size: of a longer one, a recording that is sent in pieces, the service
/// keeps no more at once.
constexpr std::uint32_t kMaxCounted = 1U << 20U;
/// A block into which gRPC reads: what is shorter keeps more than its length.
constexpr std::uint32_t kBlock = 8192;
/// Bytes that gRPC takes of a stream beyond what is read of it. Pieces that came before are read.
constexpr std::uint32_t kStreamWindow = 65'535;
/// A client widens its windows by what it was sent: for the stream and for the connection once for each
/// answer and frame of data, and for a large frame in several steps.
constexpr std::uint32_t kBytesPerWindowUpdate = 1024;
constexpr std::uint32_t kMaxWindowUpdates = 10'000;

}  // namespace

std::uint32_t Http2Monitor::Passing::length() const {
  const auto byte = [this](std::size_t i) {
    return static_cast<std::uint32_t>(static_cast<std::uint8_t>(header[i]));
  };
  return (byte(0) << 16U) | (byte(1) << 8U) | byte(2);
}

std::uint32_t Http2Monitor::Passing::stream() const {
  const auto byte = [this](std::size_t i) {
    return static_cast<std::uint32_t>(static_cast<std::uint8_t>(header[i]));
  };
  return ((byte(5) & 0x7FU) << 24U) | (byte(6) << 16U) | (byte(7) << 8U) | byte(8);
}

bool Http2Monitor::Passing::take_header(std::string_view& bytes) {
  const std::size_t taken = std::min(bytes.size(), kFrameHeader - header_size);
  std::copy_n(bytes.begin(), taken, header.begin() + static_cast<std::ptrdiff_t>(header_size));
  header_size += taken;
  bytes.remove_prefix(taken);
  if (header_size < kFrameHeader) return false;
  left = length();
  return true;
}

bool Http2Monitor::Call::take(std::string_view taken) {
  since += static_cast<std::uint32_t>(taken.size());
  bool ends = false;
  while (!taken.empty()) {
    if (left_of_message == 0) {  // its length comes first, behind one more byte
      prefix[prefix_size++] = taken.front();
      taken.remove_prefix(1);
      if (prefix_size < prefix.size()) continue;
      prefix_size = 0;
      for (std::size_t i = 1; i < prefix.size(); ++i)
        left_of_message = (left_of_message << 8U) | static_cast<std::uint8_t>(prefix[i]);
    } else {
      const std::size_t passed = std::min<std::size_t>(taken.size(), left_of_message);
      left_of_message -= static_cast<std::uint32_t>(passed);
      taken.remove_prefix(passed);
    }
    ends = ends || left_of_message == 0;
  }
  return ends;
}

Http2Monitor::~Http2Monitor() {
  account_.unfinished_bytes -= held_.size();
  while (!calls_.empty()) end_call(calls_.begin()->first);
}

void Http2Monitor::end_call(std::uint32_t stream) {
  const auto call = calls_.find(stream);
  if (call == calls_.end()) return;
  account_.unfinished_bytes -= call->second.bytes;
  account_.pieces -= call->second.pieces;
  --account_.calls;
  calls_.erase(call);
}

void Http2Monitor::release_held(std::string& onward) {
  account_.unfinished_bytes -= held_.size();
  onward += held_;
  held_.clear();
  is_in_header_ = false;
}

std::string_view Http2Monitor::from_client(std::string_view bytes, std::string& onward, Allowance::Time now) {
  while (!bytes.empty() && preface_seen_ < kPreface.size()) {
    if (bytes.front() != kPreface[preface_seen_]) return "it does not speak HTTP/2";
    onward += bytes.front();
    bytes.remove_prefix(1);
    ++preface_seen_;
  }
  Passing& frame = from_client_;
  while (!bytes.empty()) {
    if (frame.header_size < kFrameHeader) {
      if (!frame.take_header(bytes)) return {};
      if (const std::string_view problem = begin_frame(now); !problem.empty()) return problem;
      const std::string_view header(frame.header.data(), kFrameHeader);
      if (is_in_header_) {
        held_ += header;
        account_.unfinished_bytes += kFrameHeader;
      } else {
        onward += header;
      }
    }
    const std::string_view payload = bytes.substr(0, frame.left);
    bytes.remove_prefix(payload.size());
    frame.left -= static_cast<std::uint32_t>(payload.size());
    if (is_in_header_) {
      held_ += payload;
      account_.unfinished_bytes += payload.size();
    } else {
      onward += payload;
      if (frame.type() == kData) pass_data(payload);
    }
    if (frame.left > 0) return {};
    frame.header_size = 0;
    if (is_in_header_ && (frame.flags() & kEndHeaders) != 0) release_held(onward);
  }
  return {};
}

std::string_view Http2Monitor::begin_frame(Allowance::Time now) {
  const Passing& frame = from_client_;
  const std::uint8_t type = frame.type();
  if (is_in_header_ != (type == kContinuation)) return "its frames are out of order";
  if (type != kData && frame.left > kMaxControl) return "a frame is too large";
  switch (type) {
    case kHeaders:
    case kContinuation:
      return begin_header(now);
    case kData:
      return begin_data(now);
    case kReset:
      return note_reset(now);
    case kPushPromise:
      return "its frames are out of order";
    case kWindowUpdate:
      if (window_updates_ == 0) return note_control(now);
      --window_updates_;
      return {};
    case kSettings:
    case kPing:
      return (frame.flags() & kAcknowledged) != 0 ? std::string_view() : note_control(now);
    default:
      return note_control(now);
  }
}

std::string_view Http2Monitor::begin_header(Allowance::Time now) {
  const Passing& frame = from_client_;
  is_in_header_ = true;
  if (held_.size() + kFrameHeader + frame.left > kMaxHeader) return "a header is too long";
  if (frame.type() == kContinuation) return {};
  const std::uint32_t stream = frame.stream();
  if (calls_.contains(stream)) return {};
  if (stream <= last_stream_) return note_control(now);  // answered already
  last_stream_ = stream;
  if (account_.calls >= account_.limits.max_calls) return "it has too many calls under way";
  calls_.emplace(stream, Call());
  ++account_.calls;
  ++calls_begun_;
  return {};
}

std::string_view Http2Monitor::begin_data(Allowance::Time now) {
  const Passing& frame = from_client_;
  const bool says_nothing = frame.left == 0 && (frame.flags() & kEndStream) == 0;
  if (says_nothing) return note_control(now);
  const auto call = calls_.find(frame.stream());
  if (call == calls_.end()) return {};  // answered already; gRPC drops it
  const std::uint32_t more = std::min(frame.left, kMaxCounted - call->second.bytes);
  call->second.bytes += more;
  account_.unfinished_bytes += more;
  if (account_.unfinished_bytes > account_.limits.max_unfinished_bytes)
    return "its unfinished requests are too large";
  if (frame.left >= kBlock) return {};
  ++call->second.pieces;
  if (++account_.pieces > account_.limits.max_pieces) return "its requests come in too many pieces";
  return {};
}

// Forgets pieces that were read: the service holds the messages of the window, and the one that has not
// ended.
void Http2Monitor::pass_data(std::string_view payload) {
  const auto found = calls_.find(from_client_.stream());
  if (found == calls_.end()) return;
  Call& call = found->second;
  if (!call.take(payload) || call.since < kStreamWindow) return;
  account_.pieces -= std::exchange(call.pieces, 0);
  call.since = 0;
}

std::string_view Http2Monitor::note_reset(Allowance::Time now) {
  if (!calls_.contains(from_client_.stream())) return note_control(now);  // answered already
  end_call(from_client_.stream());
  return account_.resets.take(now) ? std::string_view() : "it opens calls and gives them up at once";
}

std::string_view Http2Monitor::note_control(Allowance::Time now) {
  const bool may = controls_.take(now) || account_.controls.take(now);
  return may ? std::string_view() : "it sends frames that belong to no call";
}

void Http2Monitor::allow_window_updates(std::uint32_t size) {
  window_updates_ = std::min(kMaxWindowUpdates, window_updates_ + 2 + size / kBytesPerWindowUpdate);
}

void Http2Monitor::from_service(std::string_view bytes) {
  Passing& frame = from_service_;
  while (!bytes.empty()) {
    if (frame.header_size < kFrameHeader) {
      if (!frame.take_header(bytes)) return;
      const std::uint8_t type = frame.type();
      const bool can_end = type == kData || type == kHeaders;
      if (can_end) allow_window_updates(frame.left);  // also of a refusal, which has no data
      if (type == kReset || (can_end && (frame.flags() & kEndStream) != 0)) {
        if (calls_.contains(frame.stream())) ++calls_answered_;
        end_call(frame.stream());
      }
    }
    const std::size_t passed = std::min<std::size_t>(bytes.size(), frame.left);
    bytes.remove_prefix(passed);
    frame.left -= static_cast<std::uint32_t>(passed);
    if (frame.left > 0) return;
    frame.header_size = 0;
  }
}

}  // namespace hapticd::server
