#pragma once

#include <sys/socket.h>

#include <cstddef>
#include <cstdint>
#include <optional>

namespace hapticd::server {

/// Client behind an address: one for all addresses that one machine may choose from.
std::uint64_t client_of(const sockaddr_storage& address);

// A number of places for connections that many clients share: for a new connection the oldest one of the
// client that has the most is closed, so that one client cannot hold the last place. A place has a
// `descriptor` (-1: free), the number of its `client`, and the time at which it was `begun`.

/// Number of places that a client has.
template <class Places>
std::size_t count_of(const Places& places, std::uint64_t client) {
  std::size_t count = 0;
  for (const auto& one : places) count += one.descriptor >= 0 && one.client == client ? 1U : 0U;
  return count;
}

/// Oldest connection of the client that has the most, one more of `client` counted; null: there is none.
template <class Places>
typename Places::value_type* oldest_of_most(Places& places, std::optional<std::uint64_t> client) {
  std::size_t most = 0;
  typename Places::value_type* chosen = nullptr;
  for (auto& one : places) {
    if (one.descriptor < 0) continue;
    const std::size_t count =
        count_of(places, one.client) + (client == one.client ? 1 : 0);  // with the new one
    const bool goes_first = chosen == nullptr || count > most || (count == most && one.begun < chosen->begun);
    if (!goes_first) continue;
    most = count;
    chosen = &one;
  }
  return chosen;
}

}  // namespace hapticd::server
