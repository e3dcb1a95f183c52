#pragma once

// Internal to the library.

#include <netdb.h>

#include <chrono>
#include <memory>
#include <string>

namespace hapticd::client {

/// Addresses of a host, as getaddrinfo() gives them.
struct HostAddresses {
  std::shared_ptr<const addrinfo> first;  ///< null: none
  std::string problem;                    ///< why there are none; empty if the time was over
};

/// Finds the addresses of a host for connections to `port`. An address in numbers is one at once. A name is
/// asked for on a thread that may outlive this call: the system's own look-up cannot be ended, and waits for
/// seconds for a name server that is gone. The time is over at `until`, or when the descriptor `cancelled`
/// can be read.
HostAddresses look_up(const std::string& host, const std::string& port,
                      std::chrono::steady_clock::time_point until, int cancelled);

}  // namespace hapticd::client
