#pragma once

#include <chrono>
#include <memory>

#include "hapticd/v1/identification.pb.h"

namespace hapticd::client {

/// Watches one identification. Destroying it ends the watching and nothing else: the identification belongs
/// to the daemon. Use it from one thread.
class IdentificationStream {
 public:
  enum class Event {
    kProgress,  ///< `progress` was filled
    kNothing,   ///< nothing came within the wait; try again
    kEnded,     ///< it is over, as the last progress reported
  };

  IdentificationStream(IdentificationStream&&) noexcept;
  IdentificationStream& operator=(IdentificationStream&&) noexcept;
  ~IdentificationStream();

  /// Waits up to `wait` for the next progress; one comes ten times a second. Throws Error when the connection
  /// broke (kUnreachable), when the daemon knows no such identification (NOT_FOUND), and TOO_MANY where 16
  /// clients watch already.
  Event next(v1::IdentificationProgress& progress, std::chrono::milliseconds wait);

 private:
  friend class Client;
  struct State;
  explicit IdentificationStream(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

}  // namespace hapticd::client
