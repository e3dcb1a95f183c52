#include "client/cpp/tls_failure.h"

#include <arpa/inet.h>
#include <netdb.h>
#include <netinet/in.h>
#include <openssl/err.h>
#include <openssl/ssl.h>
#include <openssl/x509v3.h>
#include <sys/socket.h>
#include <sys/time.h>
#include <unistd.h>

#include <array>
#include <string_view>

#include "client/cpp/tls/openssl_support.h"

namespace hapticd::client {
namespace {

struct Socket {
  ~Socket() {
    if (descriptor >= 0) close(descriptor);
  }
  int descriptor = -1;
};

void connect_to(const std::string& host, const std::string& port, std::chrono::milliseconds timeout,
                Socket& opened) {
  addrinfo hints{};
  hints.ai_socktype = SOCK_STREAM;
  addrinfo* found = nullptr;
  if (getaddrinfo(host.c_str(), port.c_str(), &hints, &found) != 0) return;
  timeval wait{};
  wait.tv_sec = timeout.count() / 1000;
  wait.tv_usec = timeout.count() % 1000 * 1000;
  for (const addrinfo* one = found; one != nullptr && opened.descriptor < 0; one = one->ai_next) {
    const int descriptor = socket(one->ai_family, SOCK_STREAM | SOCK_CLOEXEC, 0);
    if (descriptor < 0) continue;
    setsockopt(descriptor, SOL_SOCKET, SO_RCVTIMEO, &wait, sizeof wait);
    setsockopt(descriptor, SOL_SOCKET, SO_SNDTIMEO, &wait, sizeof wait);
    if (connect(descriptor, one->ai_addr, one->ai_addrlen) == 0) {
      opened.descriptor = descriptor;
    } else {
      close(descriptor);
    }
  }
  freeaddrinfo(found);
}

v1::ErrorDetail detail(const std::string& what, const std::string& where, const std::string& value,
                       const std::string& remedy) {
  v1::ErrorDetail made;
  made.set_what(what);
  made.set_where(where);
  made.set_value(value);
  made.set_remedy(remedy);
  return made;
}

/// Whether a daemon speaks plainly there: it answers the beginning of a plain connection (RFC 9113, 3.4) with
/// a frame of settings.
bool speaks_plainly(const std::string& address, std::chrono::milliseconds timeout) {
  Socket opened;
  connect_to(host_of(address), port_of(address), timeout, opened);
  if (opened.descriptor < 0) return false;
  constexpr std::string_view kBegin{"PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n\0\0\0\x04\0\0\0\0\0", 33};
  constexpr char kSettings = 4;
  std::array<char, 9> frame{};
  if (send(opened.descriptor, kBegin.data(), kBegin.size(), MSG_NOSIGNAL) < 0) return false;
  return recv(opened.descriptor, frame.data(), frame.size(), MSG_WAITALL) ==
             static_cast<ssize_t>(frame.size()) &&
         frame[3] == kSettings;
}

v1::ErrorDetail port_is_plain(const std::string& address) {
  const std::string plain = address.starts_with("tls:") ? address.substr(4) : address;
  return detail("this port speaks without certificates", address, "a connection with certificates (tls:)",
                needs_certificates(plain) ? "name the port of the daemon's [network] listen_tls"
                                          : "leave tls: out: --server " + plain +
                                                ", or name the port of the daemon's [network] listen_tls");
}

/// The names a daemon's certificate is for.
std::string names_of(X509* certificate) {
  auto* names =
      static_cast<GENERAL_NAMES*>(X509_get_ext_d2i(certificate, NID_subject_alt_name, nullptr, nullptr));
  std::string list;
  for (int i = 0; i < sk_GENERAL_NAME_num(names); ++i) {
    const GENERAL_NAME* name = sk_GENERAL_NAME_value(names, i);
    std::string text;
    if (name->type == GEN_DNS) {
      text.assign(reinterpret_cast<const char*>(ASN1_STRING_get0_data(name->d.dNSName)),
                  static_cast<std::size_t>(ASN1_STRING_length(name->d.dNSName)));
    } else if (name->type == GEN_IPADD) {
      char address[INET6_ADDRSTRLEN] = {};
      const bool is_v4 = ASN1_STRING_length(name->d.iPAddress) == static_cast<int>(sizeof(in_addr));
      if (inet_ntop(is_v4 ? AF_INET : AF_INET6, ASN1_STRING_get0_data(name->d.iPAddress), address,
                    sizeof address) != nullptr)
        text = std::string("address ") + address;
    }
    if (!text.empty()) list += (list.empty() ? "" : ", ") + text;
  }
  GENERAL_NAMES_free(names);
  return list;
}

v1::ErrorDetail wrong_daemon(SSL* tls, long result, const std::string& address) {
  X509* shown = SSL_get1_peer_certificate(tls);
  const std::string names = shown == nullptr ? "" : names_of(shown);
  X509_free(shown);
  switch (result) {
    case X509_V_ERR_HOSTNAME_MISMATCH:
    case X509_V_ERR_IP_ADDRESS_MISMATCH:
      return detail("the daemon's certificate is for another name", address,
                    host_of(address) + "; it is for " + names,
                    "use one of its names, or have a certificate made for this one");
    case X509_V_ERR_CERT_HAS_EXPIRED:
      return detail("the daemon's certificate has expired", address, "",
                    "have a maintainer replace it: deploy/make_certificates.sh");
    case X509_V_ERR_CERT_NOT_YET_VALID:
      return detail("the daemon's certificate is not valid yet", address, "",
                    "compare the clocks of both machines");
    default:
      return detail("the daemon's certificate is not from your lab's authority", address,
                    X509_verify_cert_error_string(result),
                    "if this is the right machine, ask a maintainer for its authority.crt");
  }
}

v1::ErrorDetail wrong_client(const std::string& reason, const CertificateFiles& files) {
  return detail("the daemon does not accept your certificate", files.certificate, reason,
                "it must be from the authority of that rig: ask one of its maintainers");
}

}  // namespace

std::optional<v1::ErrorDetail> explain_tls_failure(const std::string& address, const CertificateFiles& files,
                                                   std::chrono::milliseconds timeout) {
  const NoPipeSignal held;
  ERR_clear_error();
  const TlsContext context(SSL_CTX_new(TLS_client_method()));
  if (SSL_CTX_load_verify_locations(context.get(), files.authority.c_str(), nullptr) != 1) {
    return detail("the authority's certificate cannot be used", files.authority,
                  newest_tls_problem("no reason given"), "ask a maintainer of the rig for it");
  }
  if (SSL_CTX_use_certificate_chain_file(context.get(), files.certificate.c_str()) != 1) {
    return detail("your certificate cannot be used", files.certificate, newest_tls_problem("no reason given"),
                  "ask a maintainer of the rig for another one");
  }
  if (SSL_CTX_use_PrivateKey_file(context.get(), files.key.c_str(), SSL_FILETYPE_PEM) != 1) {
    return detail("the key of your certificate cannot be used", files.key,
                  newest_tls_problem("no reason given"),
                  "both must come from the same run of make_certificates.sh");
  }
  // The daemon itself does not say why it refuses.
  if (X509_cmp_current_time(X509_get0_notAfter(SSL_CTX_get0_certificate(context.get()))) < 0) {
    return detail("your certificate has expired", files.certificate, "",
                  "ask a maintainer of the rig for another one");
  }
  Socket opened;
  const std::string host = host_of(address);
  connect_to(host, port_of(address), timeout, opened);
  if (opened.descriptor < 0) return std::nullopt;
  const TlsSession tls(SSL_new(context.get()));
  SSL_set_fd(tls.get(), opened.descriptor);
  std::string shown_host = host;  // what the macro SSL_set_tlsext_host_name does, without its cast
  SSL_ctrl(tls.get(), SSL_CTRL_SET_TLSEXT_HOSTNAME, TLSEXT_NAMETYPE_host_name, shown_host.data());
  SSL_set_verify(tls.get(), SSL_VERIFY_NONE, nullptr);  // so that what the daemon shows can be read
  auto* rules = SSL_get0_param(tls.get());
  if (X509_VERIFY_PARAM_set1_ip_asc(rules, host.c_str()) != 1)
    X509_VERIFY_PARAM_set1_host(rules, host.c_str(), 0);
  constexpr unsigned char kHttp2[] = {2, 'h', '2'};
  SSL_set_alpn_protos(tls.get(), kHttp2, sizeof kHttp2);
  ERR_clear_error();
  const bool connected = SSL_connect(tls.get()) == 1;
  const long result = SSL_get_verify_result(tls.get());
  if (result != X509_V_OK) return wrong_daemon(tls.get(), result, address);
  if (!connected) {
    const unsigned long code = ERR_peek_last_error();
    // A reason from this number on is an alert that the daemon sent.
    const bool is_alert = ERR_GET_LIB(code) == ERR_LIB_SSL && ERR_GET_REASON(code) >= SSL_AD_REASON_OFFSET;
    if (is_alert) return wrong_client(newest_tls_problem("no reason given"), files);
    if (speaks_plainly(address, timeout)) return port_is_plain(address);
    if (code == 0) return std::nullopt;
    return detail("no encrypted connection comes about", address, newest_tls_problem("no reason given"),
                  "does the daemon listen there with certificates ([network] listen_tls)?");
  }
  // With TLS 1.3 a daemon that refuses the client's certificate says so after the handshake.
  char byte = 0;
  if (SSL_read(tls.get(), &byte, 1) <= 0 && ERR_peek_last_error() != 0)
    return wrong_client(newest_tls_problem("no reason given"), files);
  return std::nullopt;
}

std::optional<v1::ErrorDetail> explain_plain_failure(const std::string& address,
                                                     std::chrono::milliseconds timeout) {
  Socket opened;
  connect_to(host_of(address), port_of(address), timeout, opened);
  if (opened.descriptor < 0) return std::nullopt;
  const NoPipeSignal no_signal;
  const TlsContext context(SSL_CTX_new(TLS_client_method()));
  const TlsSession tls(SSL_new(context.get()));
  SSL_set_fd(tls.get(), opened.descriptor);
  SSL_set_verify(tls.get(), SSL_VERIFY_NONE, nullptr);
  ERR_clear_error();
  SSL_connect(tls.get());
  ERR_clear_error();
  X509* shown = SSL_get1_peer_certificate(tls.get());
  if (shown == nullptr) return std::nullopt;
  X509_free(shown);
  return detail(
      "this port expects certificates", address, "a plain connection",
      "write tls: before the address: --server tls:" + address + "; certificates: see docs/access.md");
}

}  // namespace hapticd::client
