#pragma once

#include <boost/asio/ip/tcp.hpp>
#include <optional>

namespace hapticd::console {

/// The user of this machine who made a connection within it, by number, as the kernel says. `peer`: the other
/// end, `own`: this end. Nothing if the kernel does not know the other end, e.g. as it is on another machine
/// or in another container.
std::optional<unsigned> user_of_connection(const boost::asio::ip::tcp::endpoint& peer,
                                           const boost::asio::ip::tcp::endpoint& own);

}  // namespace hapticd::console
