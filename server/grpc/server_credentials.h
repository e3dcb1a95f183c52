#pragma once

#include <grpcpp/security/server_credentials.h>

#include <memory>
#include <string>

namespace hapticd::server {

/// TLS with certificates of both sides, from a folder of server.crt, server.key and authority.crt. The files
/// are read again when they change; connections that exist go on.
std::shared_ptr<grpc::ServerCredentials> credentials_from(const std::string& folder);

}  // namespace hapticd::server
