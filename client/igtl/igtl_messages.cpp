#include "client/igtl/igtl_messages.h"

#include <igtlMath.h>
#include <igtlStatusMessage.h>
#include <igtlTransformMessage.h>
#include <igtl_util.h>

#include <algorithm>
#include <bit>
#include <cctype>
#include <cmath>
#include <span>
#include <string_view>

#include "hapticd/v1/telemetry.pb.h"

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

/// Quaternion of a matrix whose columns are of length 1 and at right angles, to a thousandth; otherwise why
/// it has none.
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

using Bytes = std::span<const std::uint8_t>;

/// The unsigned number of `size` bytes at the beginning, which there are; they are taken from `bytes`.
std::uint64_t take_number(Bytes& bytes, std::size_t size) {
  std::uint64_t number = 0;
  for (const std::uint8_t byte : bytes.first(size)) number = number << 8U | byte;
  bytes = bytes.subspan(size);
  return number;
}

/// A text in a field of `size` bytes, which ends at its first zero.
std::string take_text(Bytes& bytes, std::size_t size) {
  const Bytes field = bytes.first(size);
  bytes = bytes.subspan(size);
  return {field.begin(), std::find(field.begin(), field.end(), std::uint8_t{0})};
}

/// The header is the same in all versions of the protocol. Debian's library reads version 1 only.
struct Header {
  static constexpr std::size_t kSize = 58;

  explicit Header(Bytes bytes)
      : version(static_cast<unsigned>(take_number(bytes, 2))),
        type(take_text(bytes, 12)),
        name(take_text(bytes, 20)),
        stamp_s(take_number(bytes, 4)),
        stamp_fraction(take_number(bytes, 4)),
        body_size(take_number(bytes, 8)),
        checksum(take_number(bytes, 8)) {}

  unsigned version;
  std::string type;
  std::string name;
  std::uint64_t stamp_s;         ///< since 1970
  std::uint64_t stamp_fraction;  ///< in 2⁻³² s
  std::uint64_t body_size;
  std::uint64_t checksum;
};

bool is_word(const std::string& type) {
  return !type.empty() &&
         std::all_of(type.begin(), type.end(), [](unsigned char c) { return std::isprint(c) != 0; });
}

/// Lower case, without blanks and the zeros of wider characters.
std::string plain_word(std::string_view text) {
  std::string word;
  for (const char character : text) {
    const auto c = static_cast<unsigned char>(character);
    if (c > ' ') word += static_cast<char>(std::tolower(c));
  }
  return word;
}

constexpr unsigned kNewestVersion = 3;
constexpr std::size_t kTransformSize = 48;
constexpr const char* kWrongSize = "the sizes in a TRANSFORM do not fit together";

/// The status of the tool in the metadata of a message: pairs of key and value, whose sizes come first.
/// Returns a problem if they do not fit.
std::string read_status(Bytes sizes, Bytes texts, std::string& not_tracked) {
  if (sizes.size() < 2) return sizes.empty() && texts.empty() ? "" : kWrongSize;
  for (std::uint64_t pairs = take_number(sizes, 2); pairs > 0; --pairs) {
    if (sizes.size() < 8) return kWrongSize;
    const auto key_size = static_cast<std::size_t>(take_number(sizes, 2));
    take_number(sizes, 2);  // the encoding
    const auto value_size = static_cast<std::size_t>(take_number(sizes, 4));
    if (key_size > texts.size() || value_size > texts.size() - key_size) return kWrongSize;
    const auto text_of = [&texts](std::size_t size) {
      const std::string text(texts.begin(), texts.begin() + static_cast<std::ptrdiff_t>(size));
      texts = texts.subspan(size);
      return text;
    };
    const std::string key = plain_word(text_of(key_size));
    const std::string value = text_of(value_size);
    // Some peers put the transform's name before it.
    if (key.ends_with("transformstatus") && plain_word(value) != "ok")
      not_tracked = value.empty() ? "unknown" : value;
  }
  return {};
}

/// Finds the content: from version 2 on, a separate header comes before the content, and metadata behind it.
std::string find_content(const Header& header, Bytes body, Bytes& content, std::string& not_tracked) {
  content = body;
  if (header.version > 1) {
    constexpr std::size_t kExtendedSize = 12;
    if (body.size() < kExtendedSize) return kWrongSize;
    Bytes fields = body;
    const auto own_size = static_cast<std::size_t>(take_number(fields, 2));
    const auto sizes_size = static_cast<std::size_t>(take_number(fields, 2));
    const auto texts_size = static_cast<std::size_t>(take_number(fields, 4));
    if (own_size < kExtendedSize || own_size + sizes_size + texts_size > body.size()) return kWrongSize;
    content = body.subspan(own_size, body.size() - own_size - sizes_size - texts_size);
    const std::string problem = read_status(body.subspan(body.size() - sizes_size - texts_size, sizes_size),
                                            body.last(texts_size), not_tracked);
    if (!problem.empty()) return problem;
  }
  return content.size() == kTransformSize ? "" : kWrongSize;
}

/// Returns why the transform cannot be used; empty if it can.
std::string read_transform(const Header& header, Packed& body, ReceivedTransform& transform) {
  transform = ReceivedTransform{.name = header.name};
  if (header.version < 1 || header.version > kNewestVersion) {
    return "a TRANSFORM with header version " + std::to_string(header.version) + "; versions 1 to " +
           std::to_string(kNewestVersion) + " are read";
  }
  if (crc64(body.data(), body.size(), 0) != header.checksum)
    return "the checksum of a TRANSFORM does not match";
  Bytes content;
  std::string problem = find_content(header, body, content, transform.not_tracked);
  if (!problem.empty()) return problem;
  igtl::Matrix4x4 matrix{};
  for (int column = 0; column < 4; ++column) {
    for (int row = 0; row < 3; ++row)
      matrix[row][column] = std::bit_cast<float>(static_cast<std::uint32_t>(take_number(content, 4)));
  }
  // The matrix of a tool that is not tracked may hold anything.
  if (!transform.not_tracked.empty()) return {};
  for (int i = 0; i < 3; ++i) transform.position_mm[i] = static_cast<double>(matrix[i][3]);
  transform.utc_ns = static_cast<std::int64_t>(header.stamp_s * 1'000'000'000U +
                                               (header.stamp_fraction * 1'000'000'000U >> 32U));
  return quaternion_of(matrix, transform.quaternion_wxyz);
}

}  // namespace

bool device_measures(std::uint32_t sample_status) {
  return (sample_status & (v1::SAMPLE_STATUS_BIT_DEVICE_FAULT | v1::SAMPLE_STATUS_BIT_DEVICE_NOT_READY)) == 0;
}

Message tool_transform(const v1::Pose& pose) {
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
  return {packed(*message, pose.time().has_utc_ns() ? pose.time().utc_ns() : kNoTime),
          {{"TransformStatus", device_measures(pose.status_bits()) ? "OK" : "INVALID"}}};
}

Message rig_status(RigStatus status, const std::string& words, std::int64_t utc_ns) {
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
  return {packed(*message, utc_ns), {}};
}

void MessageReader::add(const std::uint8_t* bytes, std::size_t count) {
  const auto skipped = static_cast<std::size_t>(std::min<std::uint64_t>(count, bytes_to_skip_));
  bytes_to_skip_ -= skipped;
  buffer_.insert(buffer_.end(), bytes + skipped, bytes + count);
}

MessageReader::Event MessageReader::next() {
  if (buffer_.size() < Header::kSize) return Event::kNothing;
  const Header header(Bytes(buffer_).first(Header::kSize));
  if (!is_word(header.type) || header.body_size > kMaxBody) {
    problem_ = "this is not OpenIGTLink: a header with the type '" + header.type + "' and a body of " +
               std::to_string(header.body_size) + " bytes (at most " + std::to_string(kMaxBody) + ")";
    return Event::kUnreadable;
  }
  if (header.version <= kNewestVersion) version_ = std::max(version_, header.version);
  const std::uint64_t size = Header::kSize + header.body_size;
  const bool is_transform = header.type == "TRANSFORM";
  Event event = Event::kOther;
  if (is_transform && header.body_size > kMaxTransform) {
    transform_ = ReceivedTransform{.name = header.name};
    problem_ = "a TRANSFORM of " + std::to_string(header.body_size) + " bytes, at most " +
               std::to_string(kMaxTransform) + " are read";
    event = Event::kBroken;
  } else if (is_transform) {
    if (buffer_.size() < size) return Event::kNothing;
    Packed body(buffer_.begin() + Header::kSize, buffer_.begin() + static_cast<std::ptrdiff_t>(size));
    problem_ = read_transform(header, body, transform_);
    event = problem_.empty() ? Event::kTransform : Event::kBroken;
  }
  const auto here = static_cast<std::size_t>(std::min<std::uint64_t>(buffer_.size(), size));
  bytes_to_skip_ = size - here;
  buffer_.erase(buffer_.begin(), buffer_.begin() + static_cast<std::ptrdiff_t>(here));
  return event;
}

}  // namespace hapticd::igtl_bridge
