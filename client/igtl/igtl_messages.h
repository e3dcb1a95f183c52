#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "hapticd/v1/pose.pb.h"

namespace hapticd::igtl_bridge {

/// A message of OpenIGTLink as it goes over the wire: header, body, checksum.
using Packed = std::vector<std::uint8_t>;

/// Nanoseconds of a stamp that say nothing: the peer has no clock, or the daemon no UTC.
inline constexpr std::int64_t kNoTime = 0;

/// TRANSFORM of the tool: "ToolToRig", "ToolToDevice" or "ToolToReference", columns the tool's axes, mm.
/// Stamped with the pose's UTC.
Packed tool_transform(const v1::Pose& pose);

/// What the rig can do for a peer.
enum class RigStatus { kOk, kForceIsOff, kDeviceFault, kUnreachable };
Packed rig_status(RigStatus status, const std::string& words, std::int64_t utc_ns);

/// A transform that a peer sent.
struct ReceivedTransform {
  std::string name;               ///< of the device, e.g. "StylusToTracker"
  std::int64_t utc_ns = kNoTime;  ///< by the peer's clock, since 1970
  double position_mm[3] = {0.0, 0.0, 0.0};
  double quaternion_wxyz[4] = {1.0, 0.0, 0.0, 0.0};
};

/// Takes messages out of what was received, in order. Bounded: a message that claims to be larger than
/// kMaxBody ends the connection.
class MessageReader {
 public:
  static constexpr std::size_t kMaxBody = 1U << 20U;

  void add(const std::uint8_t* bytes, std::size_t count) {
    buffer_.insert(buffer_.end(), bytes, bytes + count);
  }
  enum class Event {
    kNothing,    ///< no whole message is there
    kTransform,  ///< transform() is one
    kOther,      ///< a message of another kind was passed over
    kBroken,     ///< a transform that is none: problem() says why; the connection may go on
    kUnreadable  ///< no OpenIGTLink, or too large: close the connection
  };
  Event next();
  const ReceivedTransform& transform() const { return transform_; }
  const std::string& problem() const { return problem_; }

 private:
  Event read_transform(const std::uint8_t* message, std::size_t size);

  std::vector<std::uint8_t> buffer_;
  ReceivedTransform transform_;
  std::string problem_;
};

}  // namespace hapticd::igtl_bridge
