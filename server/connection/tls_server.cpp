#include "server/connection/tls_server.h"

#include <openssl/err.h>
#include <openssl/ssl.h>
#include <sys/stat.h>

#include <utility>

#include "server/process/log.h"

namespace hapticd::server {

namespace {

constexpr std::chrono::seconds kFilesInterval{1};
/// Key exchanges that all clients know and that cost least. With a finite field of 8192 bits, which OpenSSL
/// takes as well, a stranger would have each of his hellos cost 20 ms here and nothing there.
constexpr const char* kKeyExchanges = "X25519:P-256";
/// Bytes of a client's certificate and those that vouch for it. Each is decoded before any is judged: a stranger's
/// with compressed keys cost 5 ms a kilobyte. That of make_certificates.sh has 515 bytes.
constexpr long kMaxCertificates = 1536;

/// Newest error of the library, which is then forgotten.
std::string tls_problem() {
  const unsigned long code = ERR_peek_last_error();
  const char* reason = code == 0 ? nullptr : ERR_reason_error_string(code);
  std::string text = reason == nullptr ? "no reason given" : reason;
  ERR_clear_error();
  return text;
}

}  // namespace

TlsSession::~TlsSession() {
  SSL_free(session_);
}

ssize_t TlsSession::outcome(int result) {
  wants_write_ = false;
  if (result > 0) return result;
  const int error = SSL_get_error(session_, result);
  ERR_clear_error();
  wants_write_ = error == SSL_ERROR_WANT_WRITE;
  return wants_write_ || error == SSL_ERROR_WANT_READ ? 0 : -1;
}

TlsSession::Step TlsSession::shake_hands() {
  ERR_clear_error();
  const ssize_t result = outcome(SSL_accept(session_));
  if (result > 0) return Step::kDone;
  return result == 0 ? Step::kWants : Step::kFailed;
}

ssize_t TlsSession::read(char* bytes, std::size_t size) {
  ERR_clear_error();
  return outcome(SSL_read(session_, bytes, static_cast<int>(size)));
}

ssize_t TlsSession::write(std::string_view bytes) {
  ERR_clear_error();
  return outcome(SSL_write(session_, bytes.data(), static_cast<int>(bytes.size())));
}

void TlsSession::end() {
  SSL_shutdown(session_);
  ERR_clear_error();
}

CertificateNames TlsSession::peer() const {
  X509* certificate = SSL_get1_peer_certificate(session_);
  CertificateNames names = names_of_certificate(certificate);
  X509_free(certificate);
  return names;
}

TlsServer::TlsServer(CertificateFiles files, std::string protocol)
    : files_(std::move(files)), protocol_(std::move(protocol)) {}

TlsServer::~TlsServer() {
  SSL_CTX_free(context_);
}

hal::Result<std::unique_ptr<TlsServer>> TlsServer::open(const std::string& folder, std::string protocol) {
  std::unique_ptr<TlsServer> server(new TlsServer(CertificateFiles::in(folder), std::move(protocol)));
  if (auto error = check_certificate_files(server->files_)) return std::move(*error);
  server->loaded_ = server->stamps();
  server->context_ = server->load();
  if (server->context_ == nullptr) {
    return hal::Error{"the certificates cannot be used", folder, tls_problem(), "",
                      "make them again with deploy/make_certificates.sh"};
  }
  return server;
}

int TlsServer::choose_protocol(SSL*, const unsigned char** chosen, unsigned char* size,
                               const unsigned char* offered, unsigned offered_size, void* self) {
  const std::string_view ours = static_cast<const TlsServer*>(self)->protocol_;
  for (unsigned at = 0; at < offered_size; at += 1U + offered[at]) {
    if (at + 1 + offered[at] > offered_size) break;
    if (std::string_view(reinterpret_cast<const char*>(offered + at + 1), offered[at]) != ours) continue;
    *chosen = offered + at + 1;
    *size = offered[at];
    return SSL_TLSEXT_ERR_OK;
  }
  return SSL_TLSEXT_ERR_ALERT_FATAL;
}

// A session that is taken up again shows no certificate: there are none. Without AUTO_RETRY a read returns
// after each message of the protocol itself: else a client that changes its keys without end keeps its thread
// from all others.
SSL_CTX* TlsServer::load() {
  SSL_CTX* context = SSL_CTX_new(TLS_server_method());
  if (context == nullptr) return nullptr;
  SSL_CTX_set_min_proto_version(context, TLS1_2_VERSION);
  SSL_CTX_set_options(context, SSL_OP_NO_TICKET | SSL_OP_NO_RENEGOTIATION | SSL_OP_NO_COMPRESSION);
  SSL_CTX_set_session_cache_mode(context, SSL_SESS_CACHE_OFF);
  SSL_CTX_set_num_tickets(context, 0);
  SSL_CTX_set_mode(context, SSL_MODE_ENABLE_PARTIAL_WRITE | SSL_MODE_ACCEPT_MOVING_WRITE_BUFFER |
                                SSL_MODE_RELEASE_BUFFERS);
  SSL_CTX_clear_mode(context, SSL_MODE_AUTO_RETRY);
  SSL_CTX_set_max_cert_list(context, kMaxCertificates);
  SSL_CTX_set_verify(context, SSL_VERIFY_PEER | SSL_VERIFY_FAIL_IF_NO_PEER_CERT, nullptr);
  if (!protocol_.empty()) SSL_CTX_set_alpn_select_cb(context, &TlsServer::choose_protocol, this);
  const bool usable = SSL_CTX_set1_groups_list(context, kKeyExchanges) == 1 &&
                      SSL_CTX_use_certificate_chain_file(context, files_.certificate.c_str()) == 1 &&
                      SSL_CTX_use_PrivateKey_file(context, files_.key.c_str(), SSL_FILETYPE_PEM) == 1 &&
                      SSL_CTX_check_private_key(context) == 1 &&
                      SSL_CTX_load_verify_locations(context, files_.authority.c_str(), nullptr) == 1;
  if (usable) return context;
  SSL_CTX_free(context);
  return nullptr;
}

TlsServer::Stamps TlsServer::stamps() const {
  Stamps all{};
  std::size_t i = 0;
  for (const std::string* path : {&files_.certificate, &files_.key, &files_.authority}) {
    struct stat file {};
    if (stat(path->c_str(), &file) == 0) {
      all[i] = {static_cast<std::int64_t>(file.st_ino), file.st_mtim.tv_sec, file.st_mtim.tv_nsec,
                file.st_size};
    }
    ++i;
  }
  return all;
}

void TlsServer::look_again() {
  const auto now = std::chrono::steady_clock::now();
  if (now < look_at_) return;
  look_at_ = now + kFilesInterval;
  const Stamps present = stamps();
  if (present == loaded_) return;
  SSL_CTX* next = load();
  if (next == nullptr) {
    // Perhaps only some of them are there yet: looked at again.
    log_debug("the certificates have changed, but cannot be used yet: " + tls_problem());
    return;
  }
  loaded_ = present;
  SSL_CTX_free(std::exchange(context_, next));
  log_info("the certificates were read again");
}

std::unique_ptr<TlsSession> TlsServer::accept(int descriptor) {
  look_again();
  SSL* session = SSL_new(context_);
  if (session == nullptr) return nullptr;
  if (SSL_set_fd(session, descriptor) != 1) {
    SSL_free(session);
    return nullptr;
  }
  return std::make_unique<TlsSession>(session);
}

}  // namespace hapticd::server
