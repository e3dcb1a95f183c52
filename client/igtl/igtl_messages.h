#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "client/igtl/message.h"
#include "hapticd/v1/pose.pb.h"

namespace hapticd::igtl_bridge {

/// Nanoseconds of a stamp that say nothing: the peer has no clock, or the daemon no UTC.
inline constexpr std::int64_t kNoTime = 0;

/// TRANSFORM of the tool: "ToolToRig", "ToolToDevice" or "ToolToReference", columns the tool's axes, mm.
/// Stamped with the pose's UTC. Its metadata have the `TransformStatus`: OK, or INVALID while the device does
/// not measure.
Message tool_transform(const v1::Pose& pose);

/// What the rig can do for a peer.
enum class RigStatus { kOk, kForceIsOff, kDeviceFault, kUnreachable };
Message rig_status(RigStatus status, const std::string& words, std::int64_t utc_ns);
/// Whether the device measured at a sample with these bits of v1::SampleStatusBit.
bool device_measures(std::uint32_t sample_status);

/// A transform that a peer sent.
struct ReceivedTransform {
  std::string name;               ///< of the device, e.g. "StylusToTracker"
  std::int64_t utc_ns = kNoTime;  ///< by the peer's clock, since 1970
  double position_mm[3] = {0.0, 0.0, 0.0};
  double quaternion_wxyz[4] = {1.0, 0.0, 0.0, 0.0};
  /// The peer's word for why the pose cannot be used, e.g. "OUT_OF_VIEW". Empty = it can be used.
  std::string not_tracked{};
};

/// Takes messages out of what was received, in order, of header versions 1 to 3. Only a transform is kept
/// in memory; the body of any other message is passed over by its size.
class MessageReader {
 public:
  static constexpr std::uint64_t kMaxTransform = 1U << 20U;
  /// A header that claims more than this is damaged: even an image has some 100 MB only.
  static constexpr std::uint64_t kMaxBody = std::uint64_t{1} << 32U;

  void add(const std::uint8_t* bytes, std::size_t count);
  enum class Event {
    kNothing,    ///< no whole message is there
    kTransform,  ///< transform() is one
    kOther,      ///< a message of another kind was passed over
    kBroken,     ///< a transform that cannot be read: problem() says why; the connection may go on
    kUnreadable  ///< not OpenIGTLink: close the connection
  };
  Event next();
  const ReceivedTransform& transform() const { return transform_; }
  /// The highest header version that the peer has used and that is known here; 1 before any message.
  unsigned version() const { return version_; }
  const std::string& problem() const { return problem_; }

 private:
  std::vector<std::uint8_t> buffer_;
  std::uint64_t bytes_to_skip_ = 0;
  unsigned version_ = 1;
  ReceivedTransform transform_;
  std::string problem_;
};

}  // namespace hapticd::igtl_bridge
