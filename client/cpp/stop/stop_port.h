#pragma once

#include <chrono>
#include <cstdint>
#include <string>

namespace hapticd::client {

/// Stops by the daemon's path for it that does not pass gRPC: it serves also while all calls hang. For
/// "host:port" it is the next port, with certificates if the address needs them; for "unix:/path" the
/// datagram socket "/path.stop". Needs no connection that exists, and no message of the contract. Meanwhile
/// this thread runs ahead of what floods the processors of this machine, as far as its user may.
///
/// Returns the last completed tick when the stop was handed to the loop: the force is zero at the second tick
/// after it at the latest. Throws Error: kBadAddress, kUnreachable, kTimedOut, kRefused (the daemon denies
/// this client). `certificates`: see ClientOptions. `cancelled`: a descriptor; once it can be read, the time
/// is over.
std::uint64_t stop_by_stop_port(const std::string& address, const std::string& certificates,
                                std::chrono::milliseconds timeout, int cancelled = -1);

}  // namespace hapticd::client
