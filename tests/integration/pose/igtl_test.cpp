// hapticd-igtl, between a daemon and a peer that is made of OpenIGTLink's own library.

#include <gtest/gtest.h>
#include <igtlClientSocket.h>
#include <igtlMessageHeader.h>
#include <igtlStatusMessage.h>
#include <igtlTransformMessage.h>

#include <atomic>
#include <cmath>
#include <csignal>
#include <string>
#include <thread>

#include "client/igtl/igtl_messages.h"
#include "tests/integration/running_service.h"
#include "tests/support/child_process.h"

namespace hapticd::test {
namespace {

/// What a peer received: the type, and the parts of the two types that the bridge sends.
struct Received {
  std::string type;
  std::string name;
  igtl::Matrix4x4 matrix{};
  double stamp_s = 0.0;
  int code = -1;
  std::string words;
};

class Peer {
 public:
  explicit Peer(int port) : socket_(igtl::ClientSocket::New()) {
    connected = socket_->ConnectToServer("127.0.0.1", port) == 0;
    socket_->SetReceiveTimeout(30'000);
  }
  Received next() {
    Received received;
    auto header = igtl::MessageHeader::New();
    header->InitPack();
    if (socket_->Receive(header->GetPackPointer(), header->GetPackSize()) != header->GetPackSize())
      return received;
    header->Unpack();
    received.type = header->GetDeviceType();
    received.name = header->GetDeviceName();
    auto stamp = igtl::TimeStamp::New();
    header->GetTimeStamp(stamp);
    received.stamp_s = stamp->GetTimeStamp();
    if (received.type == "TRANSFORM") {
      auto message = igtl::TransformMessage::New();
      EXPECT_TRUE(read(*message, header));
      message->GetMatrix(received.matrix);
    } else if (received.type == "STATUS") {
      auto message = igtl::StatusMessage::New();
      EXPECT_TRUE(read(*message, header));
      received.code = message->GetCode();
      received.words = message->GetStatusString();
    }
    return received;
  }
  Received next_of(const std::string& type) {
    Received received = next();
    while (!received.type.empty() && received.type != type) received = next();
    return received;
  }
  bool send(const void* bytes, int size) { return socket_->Send(bytes, size) == 1; }

  bool connected = false;

 private:
  bool read(igtl::MessageBase& message, igtl::MessageHeader::Pointer& header) {
    message.SetMessageHeader(header);
    message.AllocatePack();
    socket_->Receive(message.GetPackBodyPointer(), message.GetPackBodySize());
    return (message.Unpack(1) & igtl::MessageHeader::UNPACK_BODY) != 0;
  }
  igtl::ClientSocket::Pointer socket_;
};

/// The bridge as a process, and the port it listens on.
struct BridgeProcess {
  explicit BridgeProcess(const std::string& server)
      : process(HAPTICD_IGTL_BINARY, {"--server", server, "--port", "0", "--rate", "100"}) {
    const std::string line = process.read_line();
    port = std::stoi(line.substr(line.rfind(':') + 1));
  }
  ChildProcess process;
  int port = 0;
};

TEST(Igtl, APeerGetsTheToolInTheRigsFrameAndTheStatus) {
  const RunningService service;
  BridgeProcess bridge(service.address());
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
  bridge.process.signal(SIGTERM);
  EXPECT_EQ(bridge.process.wait(), 0) << bridge.process.errors();
}

TEST(Igtl, APeerThatSendsNonsenseIsLeftAndTheOthersGoOn) {
  const RunningService service;
  BridgeProcess bridge(service.address());
  Peer good(bridge.port);
  Peer bad(bridge.port);
  ASSERT_TRUE(good.connected && bad.connected);
  const std::string nonsense(200, '\xff');
  bad.send(nonsense.data(), static_cast<int>(nonsense.size()));
  for (int i = 0; i < 50; ++i) ASSERT_EQ(good.next_of("TRANSFORM").type, "TRANSFORM");
  bridge.process.signal(SIGTERM);
  EXPECT_EQ(bridge.process.wait(), 0);
  EXPECT_NE(bridge.process.errors().find("has gone"), std::string::npos) << bridge.process.errors();
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

TEST(Igtl, AFloodKeepsNeitherTheOthersNorTheEndWaiting) {
  const RunningService service;
  BridgeProcess bridge(service.address());
  Peer good(bridge.port);
  ASSERT_TRUE(good.connected);
  const Flood first(bridge.port);
  const Flood second(bridge.port);
  // Among them what was sent long after the flood began.
  for (int i = 0; i < 200; ++i) ASSERT_EQ(good.next_of("TRANSFORM").type, "TRANSFORM");
  bridge.process.signal(SIGTERM);
  EXPECT_EQ(bridge.process.wait(), 0) << "it ends while both still send";
  const std::string log = bridge.process.errors();
  EXPECT_EQ(log.find_first_of("\x1b\x07\r"), std::string::npos) << log;
  EXPECT_NE(log.find("\\u001b]0;owned\\u0007\\nforged"), std::string::npos) << log;
}

TEST(Igtl, SaysThatTheDaemonIsAwayAndGoesOnWhenItIsBack) {
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
  bridge.process.signal(SIGTERM);
  EXPECT_EQ(bridge.process.wait(), 0);
}

TEST(Igtl, RefusesInWordsWhatTheDaemonRefuses) {
  const RunningService service;
  ChildProcess bridge(HAPTICD_IGTL_BINARY,
                      {"--server", service.address(), "--port", "0", "--frame", "reference"});
  EXPECT_EQ(bridge.wait(), 1);
  EXPECT_NE(bridge.errors().find("reference frame"), std::string::npos) << bridge.errors();
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
  igtl_bridge::MessageReader other;
  other.add(huge.data(), huge.size());
  EXPECT_EQ(other.next(), Event::kUnreadable);
}

TEST(IgtlMessages, APoseBecomesItsMatrix) {
  v1::Pose pose;
  pose.set_frame(v1::POSE_FRAME_REFERENCE);
  pose.mutable_position_mm()->set_z(-3.0);
  pose.mutable_orientation()->set_w(std::sqrt(0.5));
  pose.mutable_orientation()->set_z(std::sqrt(0.5));  // a quarter turn about z: x becomes y
  igtl_bridge::MessageReader reader;
  const igtl_bridge::Packed bytes = igtl_bridge::tool_transform(pose);
  reader.add(bytes.data(), bytes.size());
  ASSERT_EQ(reader.next(), igtl_bridge::MessageReader::Event::kTransform);
  EXPECT_EQ(reader.transform().name, "ToolToReference");
  EXPECT_NEAR(reader.transform().position_mm[2], -3.0, 1e-6);
  EXPECT_NEAR(reader.transform().quaternion_wxyz[0], std::sqrt(0.5), 1e-6);
  EXPECT_NEAR(reader.transform().quaternion_wxyz[3], std::sqrt(0.5), 1e-6);
}

}  // namespace
}  // namespace hapticd::test
