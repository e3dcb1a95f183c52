#pragma once

#include <string>

#include "client/cpp/tls/openssl_support.h"

namespace hapticd::client {

/// OpenSSL's context for a client with these files. Reading them takes some ms of a processor, more where it
/// is busy: a program reads them once, and again when they have changed. Any thread. Null if they cannot
/// be used; newest_tls_problem() is why.
TlsContext client_context(const std::string& certificate, const std::string& key,
                          const std::string& authority);

}  // namespace hapticd::client
