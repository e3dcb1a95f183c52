#pragma once

#include <chrono>
#include <optional>
#include <string>

#include "client/cpp/certificates.h"
#include "hapticd/v1/common.pb.h"

namespace hapticd::client {

/// Why no connection with certificates came about: gRPC itself says little more than that. Tries a separate
/// connection. Nothing if there is no answer at all, or if all is well.
std::optional<v1::ErrorDetail> explain_tls_failure(const std::string& address, const CertificateFiles& files,
                                                   std::chrono::milliseconds timeout);

/// Why no plain connection came about: the port may expect certificates. Nothing if it does not.
std::optional<v1::ErrorDetail> explain_plain_failure(const std::string& address,
                                                     std::chrono::milliseconds timeout);

}  // namespace hapticd::client
