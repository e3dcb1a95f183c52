#include "server/console/peer_certificate.h"

#include <openssl/pem.h>
#include <openssl/x509v3.h>

#include "server/access/certificate.h"
#include "server/access/role_policy.h"

namespace hapticd::server {

namespace ssl = boost::asio::ssl;

hal::Result<std::shared_ptr<ssl::context>> tls_context_from(const std::string& folder) {
  const CertificateFiles files = CertificateFiles::in(folder);
  if (auto error = check_certificate_files(files)) return *error;
  auto context = std::make_shared<ssl::context>(ssl::context::tls_server);
  boost::system::error_code failure;
  const auto keep = [&failure](auto&& call) {
    if (!failure) call(failure);
  };
  keep([&](auto& e) { context->set_options(ssl::context::no_tlsv1 | ssl::context::no_tlsv1_1, e); });
  keep([&](auto& e) { context->use_certificate_chain_file(files.certificate, e); });
  keep([&](auto& e) { context->use_private_key_file(files.key, ssl::context::pem, e); });
  keep([&](auto& e) { context->load_verify_file(files.authority, e); });
  keep([&](auto& e) { context->set_verify_mode(ssl::verify_peer | ssl::verify_fail_if_no_peer_cert, e); });
  if (failure) {
    return hal::Error{"the certificates of the console cannot be used: " + failure.message(), folder, "", "",
                      "make them again with deploy/make_certificates.sh"};
  }
  // A session that is taken up again shows no certificate.
  SSL_CTX_set_session_cache_mode(context->native_handle(), SSL_SESS_CACHE_OFF);
  SSL_CTX_set_options(context->native_handle(), SSL_OP_NO_TICKET);
  return context;
}

Identity identity_of_peer(SSL* connection, const RolePolicy& policy) {
  X509* certificate = SSL_get1_peer_certificate(connection);
  if (certificate == nullptr) return policy.of_certificate({}, {});
  std::string uri;
  if (auto* names = static_cast<GENERAL_NAMES*>(
          X509_get_ext_d2i(certificate, NID_subject_alt_name, nullptr, nullptr))) {
    for (int i = 0; i < sk_GENERAL_NAME_num(names) && uri.empty(); ++i) {
      const GENERAL_NAME* name = sk_GENERAL_NAME_value(names, i);
      if (name->type != GEN_URI) continue;
      const ASN1_IA5STRING* text = name->d.uniformResourceIdentifier;
      uri.assign(reinterpret_cast<const char*>(ASN1_STRING_get0_data(text)),
                 static_cast<std::size_t>(ASN1_STRING_length(text)));
    }
    GENERAL_NAMES_free(names);
  }
  std::string pem;
  if (BIO* memory = BIO_new(BIO_s_mem())) {
    char* data = nullptr;
    if (PEM_write_bio_X509(memory, certificate) == 1) {
      const long size = BIO_get_mem_data(memory, &data);
      pem.assign(data, static_cast<std::size_t>(size));
    }
    BIO_free(memory);
  }
  X509_free(certificate);
  return policy.of_certificate(uri, serial_of_certificate(pem));
}

}  // namespace hapticd::server
