#pragma once

#include <atomic>
#include <cstdint>
#include <string>

#include "client/cpp/client.h"
#include "client/igtl/igtl_port.h"
#include "proto/text/report_rate.h"

namespace hapticd::igtl_bridge {

struct BridgeOptions {
  client::ClientOptions daemon;
  std::string host = "127.0.0.1";
  std::uint16_t port = 18944;  ///< that of OpenIGTLink
  HeaderVersion sent = HeaderVersion::kAsThePeer;
  double rate_hz = 60.0;
  double predict_ms = 0.0;
  v1::PoseFrame frame = v1::POSE_FRAME_RIG;
  /// Transforms of this name are poses of the marker on the tool in the tracker's frame: they go to the
  /// calibration that runs. Empty = none do.
  std::string reference{};
};

/// The daemon's poses to OpenIGTLink peers, until `stop`. Connects to the daemon again when it is lost; peers
/// stay, and get a STATUS that says so. Throws client::Error if the daemon refuses the poses, and
/// std::runtime_error if the port cannot be used.
class Bridge {
 public:
  explicit Bridge(BridgeOptions options);
  std::uint16_t port() const noexcept { return port_.port(); }
  void run(const std::atomic<bool>& stop);

 private:
  static constexpr int kMaxPeerNotesPerS = 20;

  void run_connected(const std::atomic<bool>& stop);
  void take(const ReceivedTransform& transform);
  /// Sends what has come to the daemon's calibration; says once if none runs.
  void push_references(client::Client& client);
  void report(RigStatus status, const std::string& words);
  void note(const std::string& line);
  /// Notes what a peer did; of many such lines only some a second.
  void note_of_peer(const std::string& line);

  BridgeOptions options_;
  text::ReportRate peer_notes_{kMaxPeerNotesPerS};
  IgtlPort port_;
  std::string reported_;
  v1::PushReferencePosesRequest references_;  ///< since the last push
  std::string pushed_;                        ///< what became of the last push, as it was noted
  std::string not_tracked_;                   ///< why a pose was left out, as it was noted last
};

}  // namespace hapticd::igtl_bridge
