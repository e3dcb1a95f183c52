// hapticd-igtl, between a daemon and a peer that is made of OpenIGTLink's own library.

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <igtlStatusMessage.h>
#include <igtlTransformMessage.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <chrono>
#include <cmath>
#include <csignal>
#include <cstdint>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "client/igtl/igtl_port.h"
#include "tests/integration/pose/igtl_peer.h"
#include "tests/integration/running_service.h"
#include "tests/support/system/loopback.h"

namespace hapticd::test {
namespace {

class Igtl : public testing::Test {
 protected:
  const RunningService service;
  BridgeProcess bridge{service.address()};
};

TEST_F(Igtl, APeerGetsTheToolInTheRigsFrameAndTheStatus) {
  Peer peer(bridge.port);
  ASSERT_TRUE(peer.connected);
  const Received transform = peer.next_of("TRANSFORM");
  EXPECT_EQ(transform.name, "ToolToRig");
  const v1::RigState state = service.state();
  EXPECT_GT(transform.stamp_s, 1.6e9);
  for (int a = 0; a < 3; ++a) {
    double length = 0.0;
    for (int i = 0; i < 3; ++i)
      length += static_cast<double>(transform.matrix[i][a]) * transform.matrix[i][a];
    EXPECT_NEAR(length, 1.0, 1e-4);
  }
  EXPECT_LT(std::abs(transform.matrix[2][3]), 500.0F);
  const Received status = peer.next_of("STATUS");
  EXPECT_EQ(status.code, igtl::StatusMessage::STATUS_OK);
  bridge.end();
}

TEST_F(Igtl, APeerThatSendsNonsenseIsLeftAndTheOthersGoOn) {
  Peer good(bridge.port);
  Peer bad(bridge.port);
  ASSERT_TRUE(good.connected && bad.connected);
  const std::string nonsense(200, '\xff');
  bad.send(nonsense.data(), static_cast<int>(nonsense.size()));
  for (int i = 0; i < 50; ++i) ASSERT_EQ(good.next_of("TRANSFORM").type, "TRANSFORM");
  EXPECT_NE(bridge.end().find("has gone"), std::string::npos);
}

igtl_bridge::Packed tracked_transform(const std::string& status) {
  return message_of(2, "TRANSFORM", extended(transform_content(), {{"TransformStatus", status}}));
}

igtl_bridge::Packed slicer_status() {
  igtl_bridge::Packed content;
  append_number(content, 1, 2);
  content.resize(31);
  return message_of(2, "STATUS", extended(content, {{"dummy", "dummy"}}));
}

/// Checks the parts of a message of version 2, read by hand: `content_size` bytes of content, and the text of
/// all metadata one after another.
void expect_version_2(const RawMessage& raw, std::size_t content_size, const std::string& metadata) {
  ASSERT_FALSE(raw.header.empty());
  EXPECT_EQ(raw.version(), 2U);
  EXPECT_EQ(raw.number_at(50, 8), crc64(const_cast<std::uint8_t*>(raw.body.data()), raw.body.size(), 0));
  ASSERT_GT(raw.body.size(), 12U);
  const auto at = [&raw](std::size_t place, std::size_t size) {
    std::size_t number = 0;
    for (std::size_t i = 0; i < size; ++i) number = number << 8U | raw.body[place + i];
    return number;
  };
  EXPECT_EQ(at(0, 2), 12U);
  const std::size_t sizes = at(2, 2);
  const std::size_t texts = at(4, 4);
  ASSERT_EQ(raw.body.size(), 12 + content_size + sizes + texts);
  EXPECT_EQ(std::string(raw.body.end() - static_cast<std::ptrdiff_t>(texts), raw.body.end()), metadata);
}

TEST_F(Igtl, APeerGetsTheHeaderVersionThatItSends) {
  Peer older(bridge.port);
  Peer newer(bridge.port);
  ASSERT_TRUE(older.connected && newer.connected);
  EXPECT_EQ(newer.next_raw_of("TRANSFORM").version(), 1U) << "it has sent nothing yet";
  // What neither side knows, with metadata, and a message of the older version.
  ASSERT_TRUE(send_to(newer, message_of(3, "NDARRAY", extended({1, 2, 3}, {{"a", "b"}, {"", ""}}))));
  ASSERT_TRUE(send_to(newer, message_of(65535, "LATER", {1})));
  ASSERT_TRUE(send_to(older, message_of(1, "POSITION", {1, 2})));
  ASSERT_TRUE(send_to(older, message_of(65535, "LATER", {1})));
  RawMessage transform = newer.next_raw_of("TRANSFORM");
  for (int i = 0; i < 200 && transform.version() == 1; ++i) transform = newer.next_raw_of("TRANSFORM");
  expect_version_2(transform, 48, "TransformStatusOK");
  expect_version_2(newer.next_raw_of("STATUS"), 30 + std::string("ready").size() + 1, "");
  for (int i = 0; i < 50; ++i) ASSERT_EQ(older.next_raw().version(), 1U);
  EXPECT_EQ(bridge.end().find("has gone"), std::string::npos);
}

TEST(IgtlBridge, AHeaderVersionThatIsNamedIsSentToAll) {
  const RunningService service;
  for (const unsigned version : {1U, 2U}) {
    BridgeProcess bridge(service.address(), "none", std::to_string(version));
    Peer peer(bridge.port);
    ASSERT_TRUE(peer.connected);
    ASSERT_TRUE(send_to(peer, message_of(3 - version, "STRING", {1, 2})));
    for (int i = 0; i < 30; ++i) ASSERT_EQ(peer.next_raw().version(), version);
    bridge.end();
  }
}

/// What the bridge noted about poses that came with this status. No calibration runs.
std::string log_after_poses(const std::string& status) {
  const RunningService service;
  BridgeProcess bridge(service.address(), "StylusToTracker");
  Peer peer(bridge.port);
  const igtl_bridge::Packed pose = tracked_transform(status);
  // Poses are pushed twice a second.
  for (int i = 0; i < 150; ++i) {
    EXPECT_TRUE(send_to(peer, pose));
    EXPECT_FALSE(peer.next_raw_of("TRANSFORM").header.empty());
  }
  return bridge.end();
}

TEST(IgtlBridge, OnlyPosesOfATrackedToolGoToTheCalibration) {
  const std::string tracked = log_after_poses("OK");
  EXPECT_NE(tracked.find("are not taken"), std::string::npos) << tracked;
  EXPECT_EQ(tracked.find("left out"), std::string::npos) << tracked;
  const std::string lost = log_after_poses("OUT_OF_VIEW");
  EXPECT_EQ(lost.find("are not taken"), std::string::npos) << lost;
  EXPECT_NE(lost.find("TransformStatus OUT_OF_VIEW"), std::string::npos) << lost;
}

igtl_bridge::Packed sent_transform(const char* name, float scale, float mirror, float x_mm) {
  auto message = igtl::TransformMessage::New();
  message->SetDeviceName(name);
  igtl::Matrix4x4 m{};
  m[0][0] = scale * mirror;
  m[1][1] = m[2][2] = scale;
  m[3][3] = 1.0F;
  m[0][3] = x_mm;
  message->SetMatrix(m);
  auto stamp = igtl::TimeStamp::New();
  stamp->SetTimeInNanoseconds(1'700'000'000'250'000'000ULL);
  message->SetTimeStamp(stamp);
  message->Pack();
  const auto* first = static_cast<const std::uint8_t*>(message->GetPackPointer());
  return {first, first + message->GetPackSize()};
}

/// Sends whole messages without pause until the other end is gone.
class Flood {
 public:
  explicit Flood(int port)
      : peer_(port), thread_([this] {
          const igtl_bridge::Packed message = sent_transform("\x1b]0;owned\x07\nforged", 2.0F, 1.0F, 0.0F);
          std::string many;
          for (int i = 0; i < 500; ++i) many.append(message.begin(), message.end());
          while (!ending_ && peer_.send(many.data(), static_cast<int>(many.size()))) {
          }
        }) {}
  ~Flood() {
    ending_ = true;
    thread_.join();
  }

 private:
  Peer peer_;
  std::atomic<bool> ending_{false};
  std::thread thread_;
};

std::size_t times_in(const std::string& text, const std::string& part) {
  std::size_t times = 0;
  for (std::size_t at = text.find(part); at != std::string::npos; at = text.find(part, at + 1)) ++times;
  return times;
}

TEST_F(Igtl, EachKindOfAWrongTransformIsNotedOnce) {
  Peer peer(bridge.port);
  for (int i = 0; i < 3; ++i) {
    ASSERT_TRUE(send_to(peer, sent_transform("a", 1.0F, 1.0F, std::nanf(""))));
    ASSERT_TRUE(send_to(peer, sent_transform("a", 1.0F, -1.0F, 0.0F)));
  }
  // What is sent now is read after these.
  for (int i = 0; i < 20; ++i) ASSERT_EQ(peer.next_of("TRANSFORM").type, "TRANSFORM");
  const std::string log = bridge.end();
  EXPECT_EQ(times_in(log, "not finite"), 1U) << log;
  EXPECT_EQ(times_in(log, "left-handed"), 1U) << log;
}

/// Connects from an address of this machine; the descriptor does not block.
int connect_from(const char* address, std::uint16_t port) {
  sockaddr_in own = loopback(0);
  inet_pton(AF_INET, address, &own.sin_addr);
  const sockaddr_in other = loopback(port);
  const int descriptor = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  EXPECT_EQ(bind(descriptor, reinterpret_cast<const sockaddr*>(&own), sizeof own), 0);
  EXPECT_EQ(connect(descriptor, reinterpret_cast<const sockaddr*>(&other), sizeof other), 0);
  return descriptor;
}

TEST_F(Igtl, PeersThatComeAndGoFillNoLog) {
  constexpr double kMaxPerS = 20.0;
  constexpr int kPeers = 300;
  const auto began = std::chrono::steady_clock::now();
  for (int i = 0; i < kPeers; ++i) close(connect_to_loopback(bridge.port));
  Peer last(bridge.port);
  ASSERT_EQ(last.next_of("TRANSFORM").type, "TRANSFORM");
  const std::string log = bridge.end();
  const std::chrono::duration<double> took = std::chrono::steady_clock::now() - began;
  const auto lines = static_cast<double>(times_in(log, "has connected") + times_in(log, "has gone"));
  EXPECT_LE(lines, kMaxPerS * (2.0 + took.count())) << log;
  EXPECT_GT(lines, 0.0);
}

TEST_F(Igtl, AFloodKeepsNeitherTheOthersNorTheEndWaiting) {
  Peer good(bridge.port);
  ASSERT_TRUE(good.connected);
  const Flood first(bridge.port);
  const Flood second(bridge.port);
  // Among them what was sent long after the flood began.
  for (int i = 0; i < 200; ++i) ASSERT_EQ(good.next_of("TRANSFORM").type, "TRANSFORM");
  const std::string log = bridge.end();  // while both still send
  EXPECT_EQ(log.find_first_of("\x1b\x07\r"), std::string::npos) << log;
  EXPECT_NE(log.find("\\u001b]0;owned\\u0007\\nforged"), std::string::npos) << log;
}

TEST(IgtlBridge, SaysThatTheDaemonIsAwayAndGoesOnWhenItIsBack) {
  auto service = std::make_unique<RunningService>();
  BridgeProcess bridge(service->address());
  Peer peer(bridge.port);
  ASSERT_EQ(peer.next_of("TRANSFORM").type, "TRANSFORM");
  service.reset();
  Received status = peer.next_of("STATUS");
  // On its way out the daemon may still be seen stopped.
  while (status.type == "STATUS" && (status.code == igtl::StatusMessage::STATUS_OK ||
                                     status.code == igtl::StatusMessage::STATUS_DISABLED))
    status = peer.next_of("STATUS");
  EXPECT_EQ(status.code, igtl::StatusMessage::STATUS_NOT_READY) << status.words;
  bridge.end();
}

TEST(IgtlBridge, RefusesInWordsWhatTheDaemonRefuses) {
  const RunningService service;
  ChildProcess bridge(HAPTICD_IGTL_BINARY,
                      {"--server", service.address(), "--port", "0", "--frame", "reference"});
  EXPECT_EQ(bridge.wait(), 1);
  EXPECT_NE(bridge.errors().find("reference frame"), std::string::npos) << bridge.errors();
}

TEST(IgtlBridge, EndsWithTwoOnACommandLineThatCannotBe) {
  for (const char* option : {"--no-such-option", "--port=many", "--frame=table"}) {
    ChildProcess bridge(HAPTICD_IGTL_BINARY, {option});
    EXPECT_EQ(bridge.wait(), 2) << bridge.errors();
  }
}

bool is_open(int descriptor) {
  char byte = 0;
  return recv(descriptor, &byte, 1, MSG_DONTWAIT) < 0 && errno == EAGAIN;
}

TEST(IgtlPort, PeersOfOneHostKeepNoOtherHostOut) {
  igtl_bridge::IgtlPort port("127.0.0.1", 0, igtl_bridge::HeaderVersion::k1,
                             {[](const auto&) {}, [](const auto&) {}});
  std::vector<int> peers;
  for (int i = 0; i < igtl_bridge::IgtlPort::kMaxPeers + 1; ++i) {
    peers.push_back(connect_from("127.0.0.1", port.port()));
    port.serve();
  }
  EXPECT_TRUE(is_open(peers.front()));
  EXPECT_FALSE(is_open(peers.back())) << "one more of the same host";
  peers.push_back(connect_from("127.0.0.2", port.port()));
  port.serve();
  EXPECT_TRUE(is_open(peers.back()));
  EXPECT_FALSE(is_open(peers.front())) << "the oldest";
  EXPECT_EQ(port.peers(), static_cast<std::size_t>(igtl_bridge::IgtlPort::kMaxPeers));
  for (const int descriptor : peers) close(descriptor);
}

TEST(IgtlMessages, ATransformComesThroughInPiecesWithItsStamp) {
  igtl_bridge::MessageReader reader;
  const igtl_bridge::Packed bytes = sent_transform("StylusToTracker", 1.0F, 1.0F, 12.5F);
  using Event = igtl_bridge::MessageReader::Event;
  for (std::size_t i = 0; i + 1 < bytes.size(); ++i) {
    reader.add(&bytes[i], 1);
    ASSERT_EQ(reader.next(), Event::kNothing);
  }
  reader.add(&bytes.back(), 1);
  ASSERT_EQ(reader.next(), Event::kTransform);
  EXPECT_EQ(reader.transform().name, "StylusToTracker");
  EXPECT_EQ(reader.transform().position_mm[0], 12.5);
  EXPECT_NEAR(reader.transform().quaternion_wxyz[0], 1.0, 1e-6);
  // The library makes fractions of a second by halving 10^9 in whole numbers: each step may lose one.
  EXPECT_NEAR(static_cast<double>(reader.transform().utc_ns - 1'700'000'000'250'000'000LL), 0.0, 32.0);
}

/// The first event that is not kOther.
igtl_bridge::MessageReader::Event read_one(igtl_bridge::MessageReader& reader,
                                           const igtl_bridge::Packed& bytes) {
  reader.add(bytes.data(), bytes.size());
  igtl_bridge::MessageReader::Event event = reader.next();
  while (event == igtl_bridge::MessageReader::Event::kOther) event = reader.next();
  return event;
}

TEST(IgtlMessages, TransformsOfAllVersionsAreRead) {
  const igtl_bridge::Packed content = transform_content();
  for (const igtl_bridge::Packed& bytes :
       {message_of(1, "TRANSFORM", content), message_of(2, "TRANSFORM", extended(content, {})),
        message_of(3, "TRANSFORM", extended(content, {{"a", "b"}, {"TransformStatus", "OK"}})),
        message_of(2, "TRANSFORM", extended(content, {}, 20))}) {
    igtl_bridge::MessageReader reader;
    ASSERT_EQ(read_one(reader, bytes), igtl_bridge::MessageReader::Event::kTransform) << reader.problem();
    const igtl_bridge::ReceivedTransform& transform = reader.transform();
    EXPECT_EQ(transform.name, "StylusToTracker");
    EXPECT_EQ(transform.not_tracked, "");
    EXPECT_EQ(transform.position_mm[0], 10.0);
    EXPECT_EQ(transform.position_mm[2], 30.0);
    EXPECT_EQ(transform.quaternion_wxyz[0], 1.0);
    EXPECT_EQ(transform.utc_ns, 1'700'000'000'250'000'000LL);
  }
}

TEST(IgtlMessages, TheStatusOfTheToolIsRead) {
  const std::pair<Metadata, std::string> cases[] = {
      {{{"TransformStatus", "OK"}}, ""},
      {{{"TransformStatus", " ok "}}, ""},
      {{{"SomethingElse", "MISSING"}}, ""},
      {{{"TransformStatus", "OUT_OF_VIEW"}}, "OUT_OF_VIEW"},
      {{{"a", ""}, {"transformstatus", "MISSING"}, {"b", "OK"}}, "MISSING"},
      {{{"StylusToTrackerTransformStatus", "INVALID"}}, "INVALID"},
      {{{"TransformStatus", "NOT OK"}}, "NOT OK"},
      {{{"TransformStatus", ""}}, "unknown"}};
  for (const auto& [metadata, not_tracked] : cases) {
    igtl_bridge::MessageReader reader;
    EXPECT_EQ(read_one(reader, message_of(2, "TRANSFORM", extended(transform_content(), metadata))),
              igtl_bridge::MessageReader::Event::kTransform)
        << reader.problem();
    EXPECT_EQ(reader.transform().not_tracked, not_tracked);
  }
}

TEST(IgtlMessages, OtherMessagesArePassedOverByTheirSize) {
  using Event = igtl_bridge::MessageReader::Event;
  igtl_bridge::MessageReader reader;
  for (const igtl_bridge::Packed& bytes :
       {slicer_status(), message_of(0, "STRING", {1, 2}), message_of(9, "COMMAND", {}),
        message_of(65535, "A_TYPE_OF_12", igtl_bridge::Packed(1000))}) {
    reader.add(bytes.data(), bytes.size());
    ASSERT_EQ(reader.next(), Event::kOther) << reader.problem();
  }
  // An image of 30 MB, in pieces.
  igtl_bridge::Packed image = message_of(2, "IMAGE", {});
  constexpr std::uint64_t kImageSize = 30'000'000;
  for (std::size_t i = 0; i < 8; ++i) image[42 + i] = static_cast<std::uint8_t>(kImageSize >> (56 - 8 * i));
  reader.add(image.data(), image.size());
  ASSERT_EQ(reader.next(), Event::kOther);
  const igtl_bridge::Packed piece(10'000, 0xff);
  for (int i = 0; i < 3000; ++i) {
    reader.add(piece.data(), piece.size());
    ASSERT_EQ(reader.next(), Event::kNothing);
  }
  EXPECT_EQ(read_one(reader, tracked_transform("OK")), Event::kTransform) << reader.problem();
}

TEST(IgtlMessages, ATransformThatDoesNotFitIsNamedAndTheNextIsRead) {
  using Event = igtl_bridge::MessageReader::Event;
  const igtl_bridge::Packed content = transform_content();
  const igtl_bridge::Packed good = extended(content, {{"TransformStatus", "OUT_OF_VIEW"}});
  const auto changed = [&good](std::size_t place, std::uint8_t value) {
    igtl_bridge::Packed body = good;
    body[place] = value;
    return body;
  };
  constexpr std::size_t kPairs = 12 + 48;  // where the metadata's sizes begin
  igtl_bridge::Packed short_content = content;
  short_content.pop_back();
  igtl_bridge::Packed longer = content;
  longer.push_back(0);
  const std::pair<igtl_bridge::Packed, std::string> cases[] = {
      {message_of(1, "TRANSFORM", good), "do not fit"},
      {message_of(2, "TRANSFORM", content), "do not fit"},
      {message_of(2, "TRANSFORM", {}), "do not fit"},
      {message_of(2, "TRANSFORM", extended(short_content, {})), "do not fit"},
      {message_of(1, "TRANSFORM", longer), "do not fit"},
      {message_of(2, "TRANSFORM", changed(1, 4)), "do not fit"},  // its own header
      {message_of(2, "TRANSFORM", changed(0, 0xff)), "do not fit"},
      {message_of(2, "TRANSFORM", changed(2, 0xff)), "do not fit"},           // the metadata's sizes
      {message_of(2, "TRANSFORM", changed(4, 0xff)), "do not fit"},           // the metadata
      {message_of(2, "TRANSFORM", changed(kPairs, 0xff)), "do not fit"},      // how many pairs
      {message_of(2, "TRANSFORM", changed(kPairs + 2, 0xff)), "do not fit"},  // of a key
      {message_of(2, "TRANSFORM", changed(kPairs + 6, 0xff)), "do not fit"},  // of a value
      {message_of(0, "TRANSFORM", content), "header version 0"},
      {message_of(4, "TRANSFORM", good), "header version 4"},
      {message_of(2, "TRANSFORM", igtl_bridge::Packed(2'000'000)), "2000000 bytes"}};
  igtl_bridge::MessageReader reader;
  for (const auto& [bytes, complaint] : cases) {
    EXPECT_EQ(read_one(reader, bytes), Event::kBroken);
    EXPECT_NE(reader.problem().find(complaint), std::string::npos) << reader.problem();
    EXPECT_EQ(read_one(reader, tracked_transform("OK")), Event::kTransform) << "after: " << complaint;
  }
}

TEST(IgtlMessages, WhatIsNoRotationIsNamed) {
  using Event = igtl_bridge::MessageReader::Event;
  for (const auto& [bytes, complaint] :
       {std::pair{sent_transform("a", 1.0F, -1.0F, 0.0F), "left-handed"},
        std::pair{sent_transform("b", 1000.0F, 1.0F, 0.0F), "scales"},
        std::pair{sent_transform("c", 1.0F, 1.0F, std::nanf("")), "not finite"}}) {
    igtl_bridge::MessageReader reader;
    reader.add(bytes.data(), bytes.size());
    EXPECT_EQ(reader.next(), Event::kBroken);
    EXPECT_NE(reader.problem().find(complaint), std::string::npos) << reader.problem();
    EXPECT_EQ(reader.next(), Event::kNothing) << "the next message is read";
  }
}

TEST(IgtlMessages, ADamagedOrHugeMessageIsFound) {
  using Event = igtl_bridge::MessageReader::Event;
  igtl_bridge::Packed damaged = sent_transform("a", 1.0F, 1.0F, 0.0F);
  damaged.back() ^= 1U;
  igtl_bridge::MessageReader reader;
  reader.add(damaged.data(), damaged.size());
  EXPECT_EQ(reader.next(), Event::kBroken);
  igtl_bridge::Packed huge = sent_transform("a", 1.0F, 1.0F, 0.0F);
  huge[42] = 0x7f;  // the first byte of the body's size
  igtl_bridge::Packed wrapping = message_of(2, "IMAGE", {});
  std::fill_n(wrapping.begin() + 42, 8, std::uint8_t{0xff});
  for (const igtl_bridge::Packed& bytes :
       {huge, wrapping, message_of(1, "", {}), message_of(1, "\x01\x02", {}), igtl_bridge::Packed(58, 'G')}) {
    igtl_bridge::MessageReader other;
    other.add(bytes.data(), bytes.size());
    EXPECT_EQ(other.next(), Event::kUnreadable);
    EXPECT_NE(other.problem().find("not OpenIGTLink"), std::string::npos) << other.problem();
  }
}

TEST(IgtlMessages, APeerOfVersion2IsToldWhetherTheToolIsMeasured) {
  v1::Pose pose;
  pose.mutable_orientation()->set_w(1.0);
  pose.mutable_position_mm()->set_y(7.0);
  for (const auto& [bits, not_tracked] :
       {std::pair{0U, ""}, std::pair{static_cast<unsigned>(v1::SAMPLE_STATUS_BIT_DEVICE_FAULT), "INVALID"},
        std::pair{static_cast<unsigned>(v1::SAMPLE_STATUS_BIT_DEVICE_NOT_READY), "INVALID"}}) {
    pose.set_status_bits(bits);
    igtl_bridge::MessageReader reader;
    ASSERT_EQ(read_one(reader, igtl_bridge::with_version_2(igtl_bridge::tool_transform(pose), 1)),
              igtl_bridge::MessageReader::Event::kTransform)
        << reader.problem();
    EXPECT_EQ(reader.version(), 2U);
    EXPECT_EQ(reader.transform().not_tracked, not_tracked);
    if (bits == 0) {
      EXPECT_EQ(reader.transform().position_mm[1], 7.0);
    }
  }
}

TEST(IgtlMessages, APoseBecomesItsMatrix) {
  v1::Pose pose;
  pose.set_frame(v1::POSE_FRAME_REFERENCE);
  pose.mutable_position_mm()->set_z(-3.0);
  pose.mutable_orientation()->set_w(std::sqrt(0.5));
  pose.mutable_orientation()->set_z(std::sqrt(0.5));  // a quarter turn about z: x becomes y
  igtl_bridge::MessageReader reader;
  const igtl_bridge::Packed bytes = igtl_bridge::tool_transform(pose).packed;
  reader.add(bytes.data(), bytes.size());
  ASSERT_EQ(reader.next(), igtl_bridge::MessageReader::Event::kTransform);
  EXPECT_EQ(reader.transform().name, "ToolToReference");
  EXPECT_NEAR(reader.transform().position_mm[2], -3.0, 1e-6);
  EXPECT_NEAR(reader.transform().quaternion_wxyz[0], std::sqrt(0.5), 1e-6);
  EXPECT_NEAR(reader.transform().quaternion_wxyz[3], std::sqrt(0.5), 1e-6);
}

}  // namespace
}  // namespace hapticd::test
