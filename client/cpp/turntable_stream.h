#pragma once

#include <chrono>
#include <memory>

#include "hapticd/v1/turntable.pb.h"

namespace hapticd::client {

/// A motion of the turntable from its order to its end. Destroying it before that stops the table. Use it
/// from one thread.
class TurntableStream {
 public:
  enum class Event {
    kStatus,   ///< `status` was filled
    kNothing,  ///< nothing came within the wait; try again
    kEnded,    ///< the table has arrived
  };

  TurntableStream(TurntableStream&&) noexcept;
  TurntableStream& operator=(TurntableStream&&) noexcept;
  ~TurntableStream();

  /// Waits up to `wait` for the next status. Throws Error when the motion was refused, when it ended anywhere
  /// but at its target, and when the connection broke.
  Event next(v1::TurntableStatus& status, std::chrono::milliseconds wait);
  /// Has the daemon stop the table; next() then shows kEnded.
  void cancel();

 private:
  friend class Client;
  struct State;
  explicit TurntableStream(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

}  // namespace hapticd::client
