#pragma once

#include <chrono>
#include <cstdint>
#include <memory>
#include <utility>

#include "client/cpp/stream_account.h"
#include "client/cpp/telemetry_table.h"
#include "hapticd/v1/access.pb.h"
#include "hapticd/v1/calibration.pb.h"
#include "hapticd/v1/event.pb.h"
#include "hapticd/v1/guide.pb.h"
#include "hapticd/v1/identification.pb.h"
#include "hapticd/v1/pose.pb.h"
#include "hapticd/v1/recording.pb.h"
#include "hapticd/v1/telemetry.pb.h"
#include "hapticd/v1/turntable.pb.h"

namespace hapticd::client {

template <class Message>
class ServerStream;

/// The messages with which the daemon answers one call. Destroying it ends the call. Use it from one thread.
template <class Message>
class MessageStream {
 public:
  enum class Event {
    kMessage,  ///< `message` was filled
    kNothing,  ///< nothing came within the wait; try again
    kEnded,    ///< the daemon closed the stream in good order, or cancel() was called
  };

  MessageStream(MessageStream&&) noexcept;
  MessageStream& operator=(MessageStream&&) noexcept;
  ~MessageStream();

  /// Waits up to `wait` for the next message; if none came `message` keeps what it had. Throws Error when the
  /// connection broke (kUnreachable) or the call was refused, see the call in client.h.
  Event next(Message& message, std::chrono::milliseconds wait);
  /// Ends the call at once; next() then returns kEnded.
  void cancel();

 private:
  friend class Client;
  explicit MessageStream(std::unique_ptr<ServerStream<Message>> stream);
  std::unique_ptr<ServerStream<Message>> stream_;
};

/// Watches one identification, with ten messages a second. Destroying it ends the watching and nothing else:
/// the identification belongs to the daemon. kEnded: it is over, as the last message reported.
using IdentificationStream = MessageStream<v1::IdentificationProgress>;

/// Watches one calibration. Destroying it ends the watching and nothing else.
using CalibrationStream = MessageStream<v1::CalibrationProgress>;

/// Watches who controls the rig. Destroying it ends the watching.
using LeaseStream = MessageStream<v1::LeaseState>;

/// What happened on the rig, then what happens. Destroying it ends the watching.
using EventStream = MessageStream<v1::EventBatch>;

/// A motion of the turntable from its order to its end, with ten messages a second. cancel(), or destroying
/// it before the end, has the daemon stop the table. kEnded: the table has arrived, or cancel() was called.
using TurntableStream = MessageStream<v1::TurntableStatus>;

/// A motion on which the device leads the tool, with ten messages a second. cancel(), or destroying it before
/// the end, ends the motion. kEnded: the tool has arrived or met an object, as the last message reported, or
/// cancel() was called.
using GuideStream = MessageStream<v1::GuideStatus>;

/// Poses of the tool, each once. Destroying it unsubscribes. What is read late was sent late: read in a
/// thread that does nothing else, or with next(pose, 0 ms) until it returns kNothing, and use the last one.
using PoseStream = MessageStream<v1::Pose>;

/// The pieces of a file, in order. Destroying it before the end gives the file up.
using RecordingStream = MessageStream<v1::RecordingPiece>;

/// One subscription to the loop's records; destroying it unsubscribes. Reading slowly loses samples of this
/// stream only; account() says how many.
class TelemetryStream {
 public:
  using Event = MessageStream<v1::TelemetryBatch>::Event;

  /// Waits as MessageStream::next(). kMessage: `batch` has new samples, or table() new rows if blocks were
  /// asked for, and account() has counted them. Throws Error (kUnreadable) for bytes that are not a block.
  Event next(v1::TelemetryBatch& batch, std::chrono::milliseconds wait);
  void cancel() { stream_.cancel(); }

  /// What came and what is missing so far.
  const StreamAccount& account() const noexcept { return account_; }
  /// Table of the newest block; without rows if samples were asked for.
  const TelemetryTable& table() const noexcept { return table_; }

 private:
  friend class Client;
  TelemetryStream(MessageStream<v1::TelemetryBatch> stream, std::uint32_t decimation)
      : stream_(std::move(stream)), account_(decimation) {}
  MessageStream<v1::TelemetryBatch> stream_;
  StreamAccount account_;
  TelemetryTable table_;
  std::size_t tick_column_ = 0;
};

}  // namespace hapticd::client
