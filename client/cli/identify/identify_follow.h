#pragma once

#include <chrono>
#include <functional>
#include <string>

#include "client/cpp/client.h"

namespace hapticd::cli {

/// How an identification is watched.
struct IdentifyFollow {
  /// Makes a new connection when one was lost; throws client::Error.
  std::function<client::Client()> connect{};
  /// Called with each progress as it comes.
  std::function<void(const v1::IdentificationProgress&)> on_progress{};
  /// Called at least ten times a second; the text names a lost connection, empty while all is well.
  std::function<void(const std::string& notice)> on_idle{};
  /// Asked equally often: true ends the watching.
  std::function<bool()> leave{};
  /// A stream without a message for so long counts as lost.
  std::chrono::milliseconds silence{5000};
  /// The watching ends after so long without a connection.
  std::chrono::milliseconds timeout{30000};
  /// Pause between two attempts.
  std::chrono::milliseconds pause{250};
};

enum class IdentifyEnd {
  kOver,  ///< the identification ended; the last progress says how
  kLeft,  ///< `leave` ended the watching
};

/// Watches `identification` (empty = the one that runs, else the last one) to its end. When the stream breaks
/// or falls silent, it connects again, repeatedly, and goes on with the same identification;
/// `client` is then the new connection. Throws client::Error when the daemon refuses, or stays away for
/// `timeout`.
IdentifyEnd follow_identification(client::Client& client, std::string identification,
                                  const IdentifyFollow& follow);

}  // namespace hapticd::cli
