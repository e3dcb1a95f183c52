#pragma once

#include "hapticd/v1/access.pb.h"
#include "server/access/lease_state.h"
#include "server/config/access_config.h"

namespace hapticd::server {

v1::Role to_proto(Role role);
v1::LeaseRule to_proto(LeaseRule rule);
v1::LeaseExpiry to_proto(LeaseExpiry expiry);
LeaseExpiry expiry_of(v1::LeaseExpiry expiry);
void fill(const LeaseView& lease, v1::Lease& message);
void fill(const LeaseSnapshot& state, v1::LeaseState& message);

}  // namespace hapticd::server
