#pragma once

#include <boost/asio/ssl/context.hpp>
#include <chrono>
#include <filesystem>
#include <memory>
#include <string>

#include "client/console/access/sign_in.h"

namespace hapticd::console {

/// TLS with certificates of both sides, from the files server.crt, server.key and authority.crt of a folder.
/// They are read again when they change.
class PageCertificates {
 public:
  /// Throws std::runtime_error if they cannot be used.
  explicit PageCertificates(std::string folder);
  /// Context for the next connection. Looks at the files at most once a second; those that cannot be used are
  /// reported in the log, and the ones before stay.
  std::shared_ptr<boost::asio::ssl::context> current();

 private:
  const std::string folder_;
  std::shared_ptr<boost::asio::ssl::context> context_;
  std::filesystem::file_time_type time_{};
  std::chrono::steady_clock::time_point looked_at_{};
};

/// The person whose certificate a browser has shown: its name "spiffe://LAB/hapticd/ROLE/NAME" and its serial
/// number. nullptr if it has no name that the daemon could be given.
std::shared_ptr<const Session> session_of_peer(SSL* connection);

}  // namespace hapticd::console
