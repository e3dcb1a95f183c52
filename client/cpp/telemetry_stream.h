#pragma once

#include <chrono>
#include <memory>

#include "client/cpp/stream_account.h"
#include "hapticd/v1/telemetry.pb.h"

namespace hapticd::client {

/// One subscription to the loop's records. Lives as long as this object: destroying it unsubscribes. Use it
/// from one thread. Reading slowly loses samples of this stream only; account() says how many.
class TelemetryStream {
 public:
  enum class Event {
    kBatch,    ///< `batch` has new samples; account() has counted them
    kNothing,  ///< nothing came within the wait; try again
    kEnded,    ///< the daemon closed the stream in good order, or cancel() was called
  };

  TelemetryStream(TelemetryStream&&) noexcept;
  TelemetryStream& operator=(TelemetryStream&&) noexcept;
  ~TelemetryStream();

  /// Waits up to `wait` for the next batch. Where none came `batch` keeps what it had. Throws Error when the
  /// connection broke (kUnreachable) or the subscription was refused: OUT_OF_RANGE, INVALID, TOO_MANY, and
  /// UNAVAILABLE when the daemon ends.
  Event next(v1::TelemetryBatch& batch, std::chrono::milliseconds wait);
  /// Ends the subscription at once; next() then returns kEnded.
  void cancel();

  /// What came and what is missing so far.
  const StreamAccount& account() const noexcept;

 private:
  friend class Client;
  struct State;
  explicit TelemetryStream(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

}  // namespace hapticd::client
