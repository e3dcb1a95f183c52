// Clients that use the encryption itself to keep the threads busy that serve clients with certificates.

#include <gtest/gtest.h>
#include <openssl/ssl.h>
#include <signal.h>

#include <algorithm>
#include <atomic>
#include <cstdint>
#include <string>
#include <thread>

#include "client/cpp/client.h"
#include "tests/integration/running_service.h"
#include "tests/support/lab.h"
#include "tests/support/system/loopback.h"

namespace hapticd::test {
namespace {

struct Encrypted {
  int port() const { return service.daemon->tls_port(); }
  client::ClientOptions options() const {
    return {.address = "tls:127.0.0.1:" + std::to_string(port()),
            .timeout = kTimeout,
            .certificates = lab.client("screen")};
  }

  Lab lab;
  RunningService service{config_with_certificates(lab.server())};
};

/// A client that speaks TLS by hand.
class TlsClient {
 public:
  /// `more_certificates`: that it sends after its own.
  TlsClient(int port, const std::string& certificates, const char* key_exchanges, int more_certificates = 0)
      : context_(SSL_CTX_new(TLS_client_method())), socket_(connect_to_loopback(port)) {
    signal(SIGPIPE, SIG_IGN);  // OpenSSL writes to what may be closed
    SSL_CTX_use_certificate_chain_file(context_, (certificates + "/client.crt").c_str());
    SSL_CTX_use_PrivateKey_file(context_, (certificates + "/client.key").c_str(), SSL_FILETYPE_PEM);
    for (int i = 0; i < more_certificates; ++i)
      SSL_CTX_add1_chain_cert(context_, SSL_CTX_get0_certificate(context_));
    SSL_CTX_set1_groups_list(context_, key_exchanges);
    constexpr unsigned char kHttp2[] = {2, 'h', '2'};
    SSL_CTX_set_alpn_protos(context_, kHttp2, sizeof kHttp2);
    tls_ = SSL_new(context_);
    SSL_set_fd(tls_, socket_);
    const int buffer_bytes = 65'536;  // what is on its way is little of what is sent
    setsockopt(socket_, SOL_SOCKET, SO_SNDBUF, &buffer_bytes, sizeof buffer_bytes);
    setsockopt(socket_, SOL_SOCKET, SO_RCVBUF, &buffer_bytes, sizeof buffer_bytes);
    is_open_ = SSL_connect(tls_) == 1;
  }
  ~TlsClient() {
    SSL_free(tls_);
    SSL_CTX_free(context_);
    close(socket_);
  }
  TlsClient(const TlsClient&) = delete;
  TlsClient& operator=(const TlsClient&) = delete;

  bool is_open() const { return is_open_; }
  /// True if it is answered at the stop port.
  bool stops() {
    constexpr char kStop[] = "HAPTICD STOP 1\n";
    char answer = 0;
    return SSL_write(tls_, kStop, sizeof kStop - 1) > 0 && SSL_read(tls_, &answer, 1) == 1;
  }
  /// Begins HTTP/2, so that its connection stays.
  void begin_http2() {
    const std::string preface("PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n\0\0\0\4\0\0\0\0\0", 33);
    SSL_write(tls_, preface.data(), static_cast<int>(preface.size()));
  }
  /// Bytes of so many messages that only change the key.
  std::string key_updates(int count) {
    BIO* bytes = BIO_new(BIO_s_mem());
    SSL_set0_wbio(tls_, bytes);
    for (int i = 0; i < count; ++i) {
      SSL_key_update(tls_, SSL_KEY_UPDATE_NOT_REQUESTED);
      SSL_do_handshake(tls_);
    }
    char* begin = nullptr;
    const long size = BIO_get_mem_data(bytes, &begin);
    return {begin, static_cast<std::size_t>(size)};
  }
  /// False if the other side closes the connection before all of them are taken.
  bool send(const std::string& bytes, std::atomic<bool>& has_begun) const {
    constexpr std::size_t kPiece = 16'384;
    constexpr std::size_t kBeyondBuffers = 8 * kPiece;
    for (std::size_t at = 0; at < bytes.size();) {
      const ssize_t sent =
          ::send(socket_, bytes.data() + at, std::min(kPiece, bytes.size() - at), MSG_NOSIGNAL);
      if (sent <= 0) return false;
      at += static_cast<std::size_t>(sent);
      if (at > kBeyondBuffers) has_begun = true;
    }
    return true;
  }

 private:
  SSL_CTX* context_;
  SSL* tls_ = nullptr;
  int socket_;
  bool is_open_ = false;
};

TEST(TlsAttack, KeyExchangesThatCostTheDaemonMuchAreNotTaken) {
  const Encrypted daemon;
  for (const int port : {daemon.port(), daemon.port() + 1}) {
    for (const char* cheap : {"X25519", "P-256"})
      EXPECT_TRUE(TlsClient(port, daemon.lab.client("screen"), cheap).is_open()) << cheap;
    for (const char* costly : {"P-384", "P-521", "X448", "ffdhe2048", "ffdhe8192"})
      EXPECT_FALSE(TlsClient(port, daemon.lab.client("screen"), costly).is_open()) << costly;
  }
}

TEST(TlsAttack, MoreCertificatesThanVouchForOneAreNotTaken) {
  const Encrypted daemon;
  const int stop_port = daemon.port() + 1;
  EXPECT_TRUE(TlsClient(stop_port, daemon.lab.client("screen"), "X25519", 1).stops());
  EXPECT_FALSE(TlsClient(stop_port, daemon.lab.client("screen"), "X25519", 2).stops());
}

// One read of OpenSSL went on for as long as such messages came. The stop port reads by the same code.
TEST(TlsAttack, AClientThatChangesItsKeysWithoutEndKeepsNoOtherWaiting) {
  const Encrypted daemon;
  client::Client served(daemon.options());
  TlsClient attacker(daemon.port(), daemon.lab.client("screen"), "X25519");
  ASSERT_TRUE(attacker.is_open());
  attacker.begin_http2();
  const std::string flood = attacker.key_updates(100'000);
  std::atomic<bool> has_begun{false};
  std::atomic<bool> was_taken{false};
  std::thread sending([&] {
    was_taken = attacker.send(flood, has_begun);
    has_begun = true;
  });
  while (!has_begun) std::this_thread::yield();
  EXPECT_TRUE(served.rig_state().loop().running());
  EXPECT_FALSE(was_taken) << "all of the flood was read first";
  sending.join();
}

}  // namespace
}  // namespace hapticd::test
