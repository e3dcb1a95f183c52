#pragma once

#include <openssl/types.h>

#include <chrono>
#include <optional>
#include <string>

#include "hal/error.h"

namespace hapticd::server {

/// Names by which a certificate identifies its holder.
struct CertificateNames {
  std::string uri;     ///< the first of its subject alternative names that is one; empty: none
  std::string serial;  ///< as upper-case hexadecimal digits
};
/// Names in a certificate; empty ones for null.
CertificateNames names_of_certificate(const X509* certificate);
/// Organisation (O) of the subject of the first certificate in a file: make_certificates.sh writes the name
/// of the lab there. Empty if there is none.
std::string organisation_of_certificate(const std::string& path);

/// The files by which a daemon serves TLS, in one folder.
struct CertificateFiles {
  std::string certificate;  ///< server.crt
  std::string key;          ///< server.key
  std::string authority;    ///< authority.crt: who signs the certificates of clients

  static CertificateFiles in(const std::string& folder);
};

/// Refuses a folder of certificates that is not there, or is not a folder. An empty name means none; a folder
/// that this user may not see may be there.
std::optional<hal::Error> check_certificate_folder(const std::string& folder);

/// Checks what would keep a daemon from serving with these files: missing, not matching, expired, of another
/// authority.
std::optional<hal::Error> check_certificate_files(const CertificateFiles& files);

/// Time at which the first certificate in a file expires. An error if the file has none.
hal::Result<std::chrono::system_clock::time_point> expiry_of_certificate(const std::string& path);

}  // namespace hapticd::server
