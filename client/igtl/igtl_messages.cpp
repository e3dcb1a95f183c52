#include "client/igtl/igtl_messages.h"

#include <igtlMath.h>
#include <igtlMessageHeader.h>
#include <igtlStatusMessage.h>
#include <igtlTransformMessage.h>

#include <cmath>
#include <cstring>

namespace hapticd::igtl_bridge {

namespace {

Packed packed(igtl::MessageBase& message, std::int64_t utc_ns) {
  if (utc_ns > 0) {
    auto stamp = igtl::TimeStamp::New();
    stamp->SetTimeInNanoseconds(static_cast<igtlUint64>(utc_ns));
    message.SetTimeStamp(stamp);
  }
  message.Pack();
  const auto* first = static_cast<const std::uint8_t*>(message.GetPackPointer());
  return {first, first + message.GetPackSize()};
}

const char* name_of(v1::PoseFrame frame) {
  switch (frame) {
    case v1::POSE_FRAME_DEVICE:
      return "ToolToDevice";
    case v1::POSE_FRAME_REFERENCE:
      return "ToolToReference";
    default:
      return "ToolToRig";
  }
}

/// Of a matrix whose columns are of length 1 and at right angles, to a thousandth; otherwise why it is none.
std::string quaternion_of(const igtl::Matrix4x4& m, double (&wxyz)[4]) {
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 4; ++j) {
      if (!std::isfinite(m[i][j])) return "a number of the matrix is not finite";
    }
  }
  constexpr double kTolerance = 1e-3;
  const auto column = [&](int a, int b) {
    double sum = 0.0;
    for (int i = 0; i < 3; ++i) sum += static_cast<double>(m[i][a]) * static_cast<double>(m[i][b]);
    return sum;
  };
  for (int a = 0; a < 3; ++a) {
    if (std::abs(std::sqrt(column(a, a)) - 1.0) > kTolerance)
      return "the matrix scales: its columns are not of length 1";
    if (std::abs(column(a, (a + 1) % 3)) > kTolerance)
      return "the axes of the matrix are not at right angles";
  }
  const auto at = [&](int i, int j) { return static_cast<double>(m[i][j]); };
  const double determinant = at(0, 0) * (at(1, 1) * at(2, 2) - at(1, 2) * at(2, 1)) -
                             at(0, 1) * (at(1, 0) * at(2, 2) - at(1, 2) * at(2, 0)) +
                             at(0, 2) * (at(1, 0) * at(2, 1) - at(1, 1) * at(2, 0));
  if (determinant < 0.0) return "the matrix mirrors: the peer's frame is left-handed";
  // The largest of the four squares first, so that nothing is divided by a small one.
  const double squares[4] = {1.0 + at(0, 0) + at(1, 1) + at(2, 2), 1.0 + at(0, 0) - at(1, 1) - at(2, 2),
                             1.0 - at(0, 0) + at(1, 1) - at(2, 2), 1.0 - at(0, 0) - at(1, 1) + at(2, 2)};
  int largest = 0;
  for (int i = 1; i < 4; ++i) {
    if (squares[i] > squares[largest]) largest = i;
  }
  const double s = 0.5 / std::sqrt(squares[largest]);
  const double x = at(2, 1) - at(1, 2), y = at(0, 2) - at(2, 0), z = at(1, 0) - at(0, 1);
  const double xy = at(0, 1) + at(1, 0), xz = at(0, 2) + at(2, 0), yz = at(1, 2) + at(2, 1);
  const double rows[4][4] = {
      {squares[0], x, y, z}, {x, squares[1], xy, xz}, {y, xy, squares[2], yz}, {z, xz, yz, squares[3]}};
  for (int i = 0; i < 4; ++i) wxyz[i] = s * rows[largest][i];
  return {};
}

/// The header's own number: the library gives its lower half only.
std::uint64_t claimed_body(const std::uint8_t* header) {
  constexpr std::size_t kPlace = 42;  // after version, type, name and stamp
  std::uint64_t size = 0;
  for (std::size_t i = 0; i < 8; ++i) size = size << 8U | header[kPlace + i];
  return size;
}

}  // namespace

Packed tool_transform(const v1::Pose& pose) {
  auto message = igtl::TransformMessage::New();
  message->SetDeviceName(name_of(pose.frame()));
  const v1::Quaternion& q = pose.orientation();
  // Single precision is the protocol's: at 500 mm it is 30 nm.
  float wxyz[4] = {static_cast<float>(q.x()), static_cast<float>(q.y()), static_cast<float>(q.z()),
                   static_cast<float>(q.w())};
  igtl::Matrix4x4 matrix;
  igtl::QuaternionToMatrix(wxyz, matrix);
  matrix[0][3] = static_cast<float>(pose.position_mm().x());
  matrix[1][3] = static_cast<float>(pose.position_mm().y());
  matrix[2][3] = static_cast<float>(pose.position_mm().z());
  matrix[3][0] = matrix[3][1] = matrix[3][2] = 0.0F;
  matrix[3][3] = 1.0F;
  message->SetMatrix(matrix);
  return packed(*message, pose.time().has_utc_ns() ? pose.time().utc_ns() : kNoTime);
}

Packed rig_status(RigStatus status, const std::string& words, std::int64_t utc_ns) {
  auto message = igtl::StatusMessage::New();
  message->SetDeviceName("hapticd");
  switch (status) {
    case RigStatus::kOk:
      message->SetCode(igtl::StatusMessage::STATUS_OK);
      break;
    case RigStatus::kForceIsOff:
      message->SetCode(igtl::StatusMessage::STATUS_DISABLED);
      break;
    case RigStatus::kDeviceFault:
      message->SetCode(igtl::StatusMessage::STATUS_HARDWARE_FAILURE);
      break;
    case RigStatus::kUnreachable:
      message->SetCode(igtl::StatusMessage::STATUS_NOT_READY);
      break;
  }
  message->SetSubCode(0);
  message->SetErrorName(status == RigStatus::kOk ? "" : "hapticd");
  message->SetStatusString(words.c_str());
  return packed(*message, utc_ns);
}

MessageReader::Event MessageReader::next() {
  auto header = igtl::MessageHeader::New();
  header->InitPack();
  const auto header_size = static_cast<std::size_t>(header->GetPackSize());
  if (buffer_.size() < header_size) return Event::kNothing;
  std::memcpy(header->GetPackPointer(), buffer_.data(), header_size);
  if (header->Unpack() == 0) {
    problem_ = "this is no OpenIGTLink";
    return Event::kUnreadable;
  }
  const std::uint64_t claimed = claimed_body(buffer_.data());
  if (claimed > kMaxBody) {
    problem_ = "a message is larger than 1 MiB";
    return Event::kUnreadable;
  }
  const std::size_t size = header_size + static_cast<std::size_t>(claimed);
  if (buffer_.size() < size) return Event::kNothing;
  const Event event = std::strcmp(header->GetDeviceType(), "TRANSFORM") == 0
                          ? read_transform(buffer_.data(), size)
                          : Event::kOther;
  buffer_.erase(buffer_.begin(), buffer_.begin() + static_cast<std::ptrdiff_t>(size));
  return event;
}

MessageReader::Event MessageReader::read_transform(const std::uint8_t* bytes, std::size_t size) {
  auto header = igtl::MessageHeader::New();
  header->InitPack();
  std::memcpy(header->GetPackPointer(), bytes, static_cast<std::size_t>(header->GetPackSize()));
  header->Unpack();
  transform_.name = header->GetDeviceName();
  auto message = igtl::TransformMessage::New();
  message->SetMessageHeader(header);
  message->AllocatePack();
  const auto body = static_cast<std::size_t>(message->GetPackBodySize());
  const auto header_size = static_cast<std::size_t>(header->GetPackSize());
  if (header_size + body != size) {
    problem_ = "a TRANSFORM of a wrong size";
    return Event::kBroken;
  }
  std::memcpy(message->GetPackBodyPointer(), bytes + header_size, body);
  if ((message->Unpack(1) & igtl::MessageHeader::UNPACK_BODY) == 0) {
    problem_ = "the checksum of a TRANSFORM does not match";
    return Event::kBroken;
  }
  igtl::Matrix4x4 matrix;
  message->GetMatrix(matrix);
  problem_ = quaternion_of(matrix, transform_.quaternion_wxyz);
  if (!problem_.empty()) return Event::kBroken;
  for (int i = 0; i < 3; ++i) transform_.position_mm[i] = static_cast<double>(matrix[i][3]);
  auto stamp = igtl::TimeStamp::New();
  message->GetTimeStamp(stamp);
  transform_.utc_ns = static_cast<std::int64_t>(stamp->GetTimeStampInNanoseconds());
  return Event::kTransform;
}

}  // namespace hapticd::igtl_bridge
