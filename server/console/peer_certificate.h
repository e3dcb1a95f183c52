#pragma once

#include <boost/asio/ssl/context.hpp>
#include <memory>
#include <string>

#include "hal/error.h"
#include "server/access/identity.h"

namespace hapticd::server {

class RolePolicy;

/// TLS with certificates of both sides, from the folder that gRPC uses too.
hal::Result<std::shared_ptr<boost::asio::ssl::context>> tls_context_from(const std::string& folder);
/// Who showed the certificate of a connection.
Identity identity_of_peer(SSL* connection, const RolePolicy& policy);

}  // namespace hapticd::server
