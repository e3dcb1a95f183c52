#pragma once

#include <cstdint>
#include <functional>
#include <list>
#include <memory>
#include <set>
#include <string>

#include "client/igtl/igtl_messages.h"

namespace hapticd::igtl_bridge {

/// Header version that a peer gets.
enum class HeaderVersion {
  kAsThePeer,  ///< 1 until the peer sends a message of version 2 or 3
  k1,
  k2
};

/// Port to which OpenIGTLink programs connect (3D Slicer, PLUS, …), up to kMaxPeers of them; beyond that one
/// of a host that has fewer takes the place of the oldest of the host that has most. One thread; nothing here
/// waits. A peer that does not read loses whole messages, the oldest never comes late.
class IgtlPort {
 public:
  static constexpr int kMaxPeers = 8;
  /// Kinds of wrong transforms of one peer that are noted.
  static constexpr std::size_t kMaxProblems = 8;

  struct Handlers {
    std::function<void(const ReceivedTransform&)> on_transform;
    std::function<void(const std::string&)> on_note;  ///< a line for the log
  };
  /// Throws std::runtime_error with the reason if the address cannot be used. `port` 0: any free one.
  IgtlPort(const std::string& host, std::uint16_t port, HeaderVersion sent, Handlers handlers);
  ~IgtlPort();
  IgtlPort(const IgtlPort&) = delete;
  IgtlPort& operator=(const IgtlPort&) = delete;

  std::uint16_t port() const noexcept { return port_; }
  std::size_t peers() const noexcept { return peers_.size(); }
  /// Sends to all peers. A peer that has not taken the message before gets none of this one.
  void send(const Message& message);
  /// Accepts, and reads what has come: at most kMaxPeers connections and 16 kB of each peer; the rest waits
  /// for the next call.
  void serve();
  std::uint64_t skipped() const noexcept { return skipped_; }

 private:
  struct Peer {
    int descriptor = -1;
    std::string name;
    MessageReader reader;
    Packed rest;                       ///< of a message that the socket took in part
    std::set<std::string> problems{};  ///< that were noted, up to kMaxProblems
    std::uint32_t sent_with_version_2 = 0;
    bool gone = false;
  };
  void accept_peers();
  /// Has a peer leave for a new one of this host; false if no host has more.
  bool make_room_for(const std::string& host);
  void read_from(Peer& peer);
  bool write_rest(Peer& peer);
  Packed bytes_for(Peer& peer, const Message& message) const;

  HeaderVersion sent_;
  Handlers handlers_;
  int listener_ = -1;
  std::uint16_t port_ = 0;
  std::list<Peer> peers_;
  std::uint64_t skipped_ = 0;
  bool refused_ = false;  ///< someone, since a peer has gone: noted once
};

}  // namespace hapticd::igtl_bridge
