#include "client/console/access/peer_certificate.h"

#include <openssl/bn.h>
#include <openssl/x509v3.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <stdexcept>
#include <utility>

#include "client/console/access/metadata_value.h"

namespace hapticd::console {

namespace ssl = boost::asio::ssl;

namespace {

constexpr std::chrono::seconds kLookAgain{1};

std::string path_in(const std::string& folder, const char* name) {
  return folder + "/" + name;
}

std::filesystem::file_time_type newest(const std::string& folder) {
  auto time = std::filesystem::file_time_type::min();
  for (const char* name : {"server.crt", "server.key", "authority.crt"}) {
    std::error_code missing;
    const auto of_one = std::filesystem::last_write_time(path_in(folder, name), missing);
    if (!missing) time = std::max(time, of_one);
  }
  return time;
}

std::shared_ptr<ssl::context> context_from(const std::string& folder) {
  auto context = std::make_shared<ssl::context>(ssl::context::tls_server);
  boost::system::error_code failure;
  std::string file;
  const auto keep = [&](const char* name, auto&& call) {
    if (failure) return;
    file = path_in(folder, name);
    call(file, failure);
  };
  context->set_options(ssl::context::no_tlsv1 | ssl::context::no_tlsv1_1);
  context->set_verify_mode(ssl::verify_peer | ssl::verify_fail_if_no_peer_cert);
  keep("server.crt", [&](auto& path, auto& error) { context->use_certificate_chain_file(path, error); });
  keep("server.key",
       [&](auto& path, auto& error) { context->use_private_key_file(path, ssl::context::pem, error); });
  keep("authority.crt", [&](auto& path, auto& error) { context->load_verify_file(path, error); });
  if (failure) {
    throw std::runtime_error(file + ": the certificate or key cannot be used (" + failure.message() +
                             "); make them with deploy/make_certificates.sh, see docs/access.md");
  }
  // As the daemon: other key exchanges, and a hundred certificates, would have a stranger cost much time.
  SSL_CTX_set1_groups_list(context->native_handle(), "X25519:P-256");
  SSL_CTX_set_max_cert_list(context->native_handle(), 1536);
  // A session that is taken up again shows no certificate.
  SSL_CTX_set_session_cache_mode(context->native_handle(), SSL_SESS_CACHE_OFF);
  SSL_CTX_set_options(context->native_handle(), SSL_OP_NO_TICKET);
  return context;
}

std::string name_in(const X509* certificate) {
  std::string uri;
  auto* names =
      static_cast<GENERAL_NAMES*>(X509_get_ext_d2i(certificate, NID_subject_alt_name, nullptr, nullptr));
  for (int i = 0; i < sk_GENERAL_NAME_num(names) && uri.empty(); ++i) {
    const GENERAL_NAME* name = sk_GENERAL_NAME_value(names, i);
    if (name->type != GEN_URI) continue;
    const ASN1_IA5STRING* text = name->d.uniformResourceIdentifier;
    uri.assign(reinterpret_cast<const char*>(ASN1_STRING_get0_data(text)),
               static_cast<std::size_t>(ASN1_STRING_length(text)));
  }
  GENERAL_NAMES_free(names);
  return uri;
}

std::string serial_in(const X509* certificate) {
  BIGNUM* number = ASN1_INTEGER_to_BN(X509_get0_serialNumber(certificate), nullptr);
  char* digits = BN_bn2hex(number);
  std::string text = digits == nullptr ? "" : digits;
  OPENSSL_free(digits);
  BN_free(number);
  return text;
}

}  // namespace

PageCertificates::PageCertificates(std::string folder)
    : folder_(std::move(folder)), context_(context_from(folder_)), time_(newest(folder_)) {}

std::shared_ptr<ssl::context> PageCertificates::current() {
  const auto now = std::chrono::steady_clock::now();
  if (now - looked_at_ < kLookAgain) return context_;
  looked_at_ = now;
  const auto time = newest(folder_);
  if (std::exchange(time_, time) == time) return context_;
  try {
    context_ = context_from(folder_);
  } catch (const std::runtime_error& error) {
    spdlog::warn("the certificates before stay in use: {}", error.what());
  }
  return context_;
}

std::shared_ptr<const Session> session_of_peer(SSL* connection) {
  X509* certificate = SSL_get1_peer_certificate(connection);
  if (certificate == nullptr) return nullptr;
  Session session{name_in(certificate), serial_in(certificate)};
  X509_free(certificate);
  if (session.name.empty() || !is_metadata_value(session.name)) return nullptr;
  return std::make_shared<const Session>(std::move(session));
}

}  // namespace hapticd::console
