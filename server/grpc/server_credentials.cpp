#include "server/grpc/server_credentials.h"

#include <grpcpp/security/tls_certificate_provider.h>
#include <grpcpp/security/tls_credentials_options.h>

#include "server/access/certificate.h"

namespace hapticd::server {

namespace {
constexpr unsigned kLookAgainS = 1;
}

std::shared_ptr<grpc::ServerCredentials> credentials_from(const std::string& folder) {
  using namespace grpc::experimental;
  const CertificateFiles files = CertificateFiles::in(folder);
  TlsServerCredentialsOptions options(std::make_shared<FileWatcherCertificateProvider>(
      files.key, files.certificate, files.authority, kLookAgainS));
  options.watch_root_certs();
  options.watch_identity_key_cert_pairs();
  options.set_cert_request_type(GRPC_SSL_REQUEST_AND_REQUIRE_CLIENT_CERTIFICATE_AND_VERIFY);
  return TlsServerCredentials(options);
}

}  // namespace hapticd::server
