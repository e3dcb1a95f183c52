#pragma once

#include <optional>
#include <string>

#include "server/access/role_policy.h"

namespace hapticd::server {

/// The user behind the other end of a TCP connection within this machine, as the kernel knows it (sock_diag:
/// the user who made that socket). Unknown where the kernel does not say.
std::optional<unsigned> user_of_loopback_peer(int descriptor);
/// Name and groups of a user; the name is the number where it has none.
LocalUser user_of_id(unsigned id);
/// Nothing where there is no such group.
std::optional<unsigned> group_id(const std::string& name);
/// The group's name, or its number.
std::string group_name(unsigned id);

}  // namespace hapticd::server
