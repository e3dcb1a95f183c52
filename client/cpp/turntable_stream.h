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

  /// Waits up to `wait` for the next status; one comes ten times a second. Throws Error when the connection
  /// broke (kUnreachable), when the motion was refused (BUSY, WRONG_STATE: contact, force, a latched guard,
  /// not homed; NOT_FOUND: no such station; OUT_OF_RANGE; NO_HARDWARE), and when it ended anywhere but at its
  /// target (STATE_CHANGED: stopped, stalled, alarm, lost).
  Event next(v1::TurntableStatus& status, std::chrono::milliseconds wait);
  /// Has the daemon stop the table; next() then returns kEnded.
  void cancel();

 private:
  friend class Client;
  struct State;
  explicit TurntableStream(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

}  // namespace hapticd::client
