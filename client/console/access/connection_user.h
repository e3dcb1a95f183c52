#pragma once

#include <boost/asio/ip/tcp.hpp>
#include <iosfwd>
#include <optional>

namespace hapticd::console {

/// The user of this machine who made a connection within it, by number, from the kernel's list of
/// connections. `peer`: the other end, `own`: this end. Nothing if the connection is not in it, e.g. as it
/// comes from another machine or container.
std::optional<unsigned> user_of_connection(const boost::asio::ip::tcp::endpoint& peer,
                                           const boost::asio::ip::tcp::endpoint& own);
/// Finds a user in the text of such a list, as /proc/net/tcp and /proc/net/tcp6 have it.
std::optional<unsigned> user_in_list(std::istream& list, const boost::asio::ip::tcp::endpoint& peer,
                                     const boost::asio::ip::tcp::endpoint& own);

}  // namespace hapticd::console
