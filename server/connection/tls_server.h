#pragma once

#include <openssl/types.h>
#include <sys/types.h>

#include <array>
#include <chrono>
#include <ctime>
#include <memory>
#include <string>
#include <string_view>

#include "hal/error.h"
#include "server/access/certificate.h"

namespace hapticd::server {

/// One connection with certificates of both sides, on a descriptor that does not block. The descriptor stays
/// the caller's. One thread.
class TlsSession {
 public:
  enum class Step { kDone, kWants, kFailed };

  TlsSession(SSL* session) noexcept : session_(session) {}
  ~TlsSession();
  TlsSession(const TlsSession&) = delete;
  TlsSession& operator=(const TlsSession&) = delete;

  /// Goes on with the handshake; call it again when the descriptor is ready for wants_write(), else for
  /// reading.
  Step shake_hands();
  /// Bytes; 0: not now; -1: the other side has ended, or the connection is broken.
  ssize_t read(char* bytes, std::size_t size);
  ssize_t write(std::string_view bytes);
  /// Says goodbye, so that the other side knows that nothing was cut off.
  void end();
  /// True if the last step waits until the descriptor can be written to.
  bool wants_write() const noexcept { return wants_write_; }
  /// Names of the peer's certificate, after the handshake.
  CertificateNames peer() const;

 private:
  ssize_t outcome(int result);

  SSL* session_;
  bool wants_write_ = false;
};

/// Makes such connections with the certificates of a folder: server.crt, server.key and authority.crt. They
/// are read again when they change; connections that exist go on. One thread.
class TlsServer {
 public:
  /// `protocol`: of ALPN, e.g. "h2"; empty: none. An error if the files cannot be used.
  static hal::Result<std::unique_ptr<TlsServer>> open(const std::string& folder, std::string protocol);
  ~TlsServer();
  TlsServer(const TlsServer&) = delete;
  TlsServer& operator=(const TlsServer&) = delete;

  /// Accepts a connection; nothing without memory.
  std::unique_ptr<TlsSession> accept(int descriptor);

 private:
  /// What tells one version of the files from another.
  using Stamps = std::array<std::array<std::int64_t, 4>, 3>;

  TlsServer(CertificateFiles files, std::string protocol);
  static int choose_protocol(SSL*, const unsigned char** chosen, unsigned char* size,
                             const unsigned char* offered, unsigned offered_size, void* self);
  SSL_CTX* load();
  Stamps stamps() const;
  void look_again();

  const CertificateFiles files_;
  const std::string protocol_;
  SSL_CTX* context_ = nullptr;
  Stamps loaded_{};
  std::chrono::steady_clock::time_point look_at_{};
};

}  // namespace hapticd::server
