#pragma once

#include <gtest/gtest.h>
#include <igtlClientSocket.h>
#include <igtlMessageHeader.h>
#include <igtlStatusMessage.h>
#include <igtlTransformMessage.h>
#include <igtl_util.h>

#include <bit>
#include <csignal>
#include <cstdint>
#include <string>

#include "client/igtl/igtl_messages.h"
#include "tests/support/child_process.h"

namespace hapticd::test {

/// A message as its bytes came.
struct RawMessage {
  igtl_bridge::Packed header;  ///< empty: none came
  igtl_bridge::Packed body;

  /// Big-endian, in the header.
  std::uint64_t number_at(std::size_t place, std::size_t size) const {
    std::uint64_t number = 0;
    for (std::size_t i = 0; i < size; ++i) number = number << 8U | header[place + i];
    return number;
  }
  unsigned version() const { return static_cast<unsigned>(number_at(0, 2)); }
  std::string type() const { return reinterpret_cast<const char*>(&header[2]); }
};

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
  /// The next message as it came, whatever its version.
  RawMessage next_raw() {
    RawMessage raw{.header = igtl_bridge::Packed(58), .body = {}};
    if (socket_->Receive(raw.header.data(), 58) != 58) return {};
    raw.body.resize(static_cast<std::size_t>(raw.number_at(42, 8)));
    if (!raw.body.empty()) socket_->Receive(raw.body.data(), static_cast<int>(raw.body.size()));
    return raw;
  }
  RawMessage next_raw_of(const std::string& type) {
    RawMessage raw = next_raw();
    while (!raw.header.empty() && raw.type() != type) raw = next_raw();
    return raw;
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

inline bool send_to(Peer& peer, const igtl_bridge::Packed& bytes) {
  return peer.send(bytes.data(), static_cast<int>(bytes.size()));
}

/// The bridge as a process, and the port it listens on.
struct BridgeProcess {
  explicit BridgeProcess(const std::string& server, const std::string& reference = "none",
                         const std::string& version = "peer")
      : process(HAPTICD_IGTL_BINARY, {"--server", server, "--port", "0", "--rate", "100", "--reference",
                                      reference, "--header-version", version}) {
    const std::string line = process.read_line();
    port = std::stoi(line.substr(line.rfind(':') + 1));
  }
  /// Ends it in order; what it logged.
  std::string end() {
    process.signal(SIGTERM);
    EXPECT_EQ(process.wait(), 0) << process.errors();
    return process.errors();
  }
  ChildProcess process;
  int port = 0;
};

// Messages as peers of newer versions of the protocol write them, which Debian's library cannot.

inline void append_number(igtl_bridge::Packed& bytes, std::uint64_t number, int size) {
  for (int i = size - 1; i >= 0; --i) bytes.push_back(static_cast<std::uint8_t>(number >> (8 * i)));
}

inline void append_text(igtl_bridge::Packed& bytes, std::string text, std::size_t size) {
  text.resize(size);
  bytes.insert(bytes.end(), text.begin(), text.end());
}

inline igtl_bridge::Packed message_of(unsigned version, const std::string& type, igtl_bridge::Packed body) {
  igtl_bridge::Packed bytes;
  append_number(bytes, version, 2);
  append_text(bytes, type, 12);
  append_text(bytes, "StylusToTracker", 20);
  append_number(bytes, 1'700'000'000, 4);
  append_number(bytes, 1U << 30U, 4);  // a quarter of a second
  append_number(bytes, body.size(), 8);
  append_number(bytes, crc64(body.data(), body.size(), 0), 8);
  bytes.insert(bytes.end(), body.begin(), body.end());
  return bytes;
}

using igtl_bridge::Metadata;

/// The body of version 2: its own header, the content, the sizes of the metadata, and the metadata.
inline igtl_bridge::Packed extended(const igtl_bridge::Packed& content, const Metadata& metadata,
                                    unsigned own_size = 12) {
  igtl_bridge::Packed sizes, texts, body;
  append_number(sizes, metadata.size(), 2);
  for (const auto& [key, value] : metadata) {
    append_number(sizes, key.size(), 2);
    append_number(sizes, 3, 2);  // US-ASCII
    append_number(sizes, value.size(), 4);
    append_text(texts, key, key.size());
    append_text(texts, value, value.size());
  }
  append_number(body, own_size, 2);
  append_number(body, sizes.size(), 2);
  append_number(body, texts.size(), 4);
  append_number(body, 1, 4);  // number of the message
  body.resize(own_size);
  for (const igtl_bridge::Packed& part : {content, sizes, texts})
    body.insert(body.end(), part.begin(), part.end());
  return body;
}

/// The axes of the frame, at (10, 20, 30) mm.
inline igtl_bridge::Packed transform_content() {
  igtl_bridge::Packed content;
  for (const float number : {1.F, 0.F, 0.F, 0.F, 1.F, 0.F, 0.F, 0.F, 1.F, 10.F, 20.F, 30.F})
    append_number(content, std::bit_cast<std::uint32_t>(number), 4);
  return content;
}

}  // namespace hapticd::test
