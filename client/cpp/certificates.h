#pragma once

#include <string>

namespace hapticd::client {

/// The files by which a client shows who it is.
struct CertificateFiles {
  std::string certificate;  ///< client.crt
  std::string key;          ///< client.key
  std::string authority;    ///< authority.crt: who signs the certificates of daemons
};

/// Whether connections to this address carry certificates. Plain are only those within this machine: unix
/// sockets and its loopback (127.0.0.0/8, ::1, localhost), without "tls:" before the address.
bool needs_certificates(const std::string& address);

/// Certificates for a daemon: in `folder` if one is given, else in the first of these that exists:
/// $HAPTICD_CERTIFICATES, certificates/HOST and certificates in $XDG_CONFIG_HOME/hapticd (~/.config/hapticd).
/// Throws Error (kBadAddress) with the places where it looked when a file is missing.
CertificateFiles find_certificates(const std::string& address, const std::string& folder);

/// "lab1" of "tls:lab1:50051", "fd00::20" of "[fd00::20]:50051".
std::string host_of(const std::string& address);
std::string port_of(const std::string& address);

}  // namespace hapticd::client
