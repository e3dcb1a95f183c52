#include "server/access/certificate.h"

#include <openssl/bio.h>
#include <openssl/bn.h>
#include <openssl/err.h>
#include <openssl/pem.h>
#include <openssl/x509.h>
#include <openssl/x509_vfy.h>
#include <openssl/x509v3.h>

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <ctime>
#include <filesystem>
#include <memory>
#include <system_error>

namespace hapticd::server {

namespace {

constexpr const char* kMakeThem = "make them with deploy/make_certificates.sh, see docs/access.md";

template <auto free>
struct Free {
  template <class T>
  void operator()(T* object) const {
    free(object);
  }
};
using Certificate = std::unique_ptr<X509, Free<X509_free>>;
using Key = std::unique_ptr<EVP_PKEY, Free<EVP_PKEY_free>>;
using Store = std::unique_ptr<X509_STORE, Free<X509_STORE_free>>;
using Check = std::unique_ptr<X509_STORE_CTX, Free<X509_STORE_CTX_free>>;

hal::Error unusable(const char* what, const std::string& path, const std::string& why) {
  return {what, path, why, "", kMakeThem};
}

struct File {
  explicit File(const std::string& path) {
    std::error_code ignored;
    if (std::filesystem::is_fifo(path, ignored)) {  // opening it would wait for one who writes it
      reason = "it is a pipe";
      return;
    }
    handle = std::fopen(path.c_str(), "re");
    if (handle == nullptr) reason = std::strerror(errno);
  }
  ~File() {
    if (handle != nullptr) std::fclose(handle);
  }
  File(const File&) = delete;
  File& operator=(const File&) = delete;
  std::FILE* handle = nullptr;
  std::string reason;
};

hal::Result<Certificate> read_certificate(const std::string& path) {
  const File file(path);
  if (file.handle == nullptr) return unusable("a certificate cannot be read", path, file.reason);
  Certificate certificate(PEM_read_X509(file.handle, nullptr, nullptr, nullptr));
  ERR_clear_error();
  if (!certificate) return unusable("a certificate cannot be read", path, "it is no certificate in PEM");
  return certificate;
}

hal::Result<Key> read_key(const std::string& path) {
  const File file(path);
  if (file.handle == nullptr) return unusable("the key of the certificate cannot be read", path, file.reason);
  Key key(PEM_read_PrivateKey(file.handle, nullptr, nullptr, nullptr));
  ERR_clear_error();
  if (!key) return unusable("the key of the certificate cannot be read", path, "it is no key in PEM");
  return key;
}

}  // namespace

CertificateNames names_of_certificate(const X509* certificate) {
  CertificateNames found;
  if (certificate == nullptr) return found;
  const std::unique_ptr<BIGNUM, Free<BN_free>> number(
      ASN1_INTEGER_to_BN(X509_get0_serialNumber(certificate), nullptr));
  if (char* digits = number ? BN_bn2hex(number.get()) : nullptr) {
    found.serial = digits;
    OPENSSL_free(digits);
  }
  auto* names =
      static_cast<GENERAL_NAMES*>(X509_get_ext_d2i(certificate, NID_subject_alt_name, nullptr, nullptr));
  for (int i = 0; i < sk_GENERAL_NAME_num(names) && found.uri.empty(); ++i) {
    const GENERAL_NAME* name = sk_GENERAL_NAME_value(names, i);
    if (name->type != GEN_URI) continue;
    const ASN1_IA5STRING* text = name->d.uniformResourceIdentifier;
    found.uri.assign(reinterpret_cast<const char*>(ASN1_STRING_get0_data(text)),
                     static_cast<std::size_t>(ASN1_STRING_length(text)));
  }
  GENERAL_NAMES_free(names);
  ERR_clear_error();
  return found;
}

std::string organisation_of_certificate(const std::string& path) {
  const auto certificate = read_certificate(path);
  if (!certificate) return {};
  const X509_NAME* subject = X509_get_subject_name(certificate->get());
  const int at = X509_NAME_get_index_by_NID(subject, NID_organizationName, -1);
  if (at < 0) return {};
  unsigned char* text = nullptr;
  const int size = ASN1_STRING_to_UTF8(&text, X509_NAME_ENTRY_get_data(X509_NAME_get_entry(subject, at)));
  if (size < 0) return {};
  std::string name(reinterpret_cast<const char*>(text), static_cast<std::size_t>(size));
  OPENSSL_free(text);
  return name;
}

CertificateFiles CertificateFiles::in(const std::string& folder) {
  return {folder + "/server.crt", folder + "/server.key", folder + "/authority.crt"};
}

std::optional<hal::Error> check_certificate_folder(const std::string& folder) {
  namespace fs = std::filesystem;
  if (folder.empty()) return std::nullopt;
  std::error_code failure;
  const fs::file_type type = fs::status(folder, failure).type();
  if (type == fs::file_type::directory || type == fs::file_type::none) return std::nullopt;
  return hal::Error::of(hal::ErrorCode::kNotFound,
                        type == fs::file_type::not_found ? "there is no such folder" : "this is not a folder",
                        "[network] certificates", folder,
                        "a folder with server.crt, server.key and authority.crt",
                        "make it with deploy/make_certificates.sh, or correct the path");
}

std::optional<hal::Error> check_certificate_files(const CertificateFiles& files) {
  const auto certificate = read_certificate(files.certificate);
  if (!certificate) return certificate.error();
  const auto key = read_key(files.key);
  if (!key) return key.error();
  const auto authority = read_certificate(files.authority);
  if (!authority) return authority.error();
  if (X509_check_private_key(certificate->get(), key->get()) != 1) {
    ERR_clear_error();
    return unusable("the key does not belong to the certificate", files.key, files.certificate);
  }
  const Store store(X509_STORE_new());
  X509_STORE_add_cert(store.get(), authority->get());
  const Check check(X509_STORE_CTX_new());
  X509_STORE_CTX_init(check.get(), store.get(), certificate->get(), nullptr);
  X509_STORE_CTX_set_purpose(check.get(), X509_PURPOSE_SSL_SERVER);
  if (X509_verify_cert(check.get()) == 1) return std::nullopt;
  const int why = X509_STORE_CTX_get_error(check.get());
  return unusable("the certificate is not valid", files.certificate, X509_verify_cert_error_string(why));
}

hal::Result<std::chrono::system_clock::time_point> expiry_of_certificate(const std::string& path) {
  const auto certificate = read_certificate(path);
  if (!certificate) return certificate.error();
  std::tm parts{};
  if (ASN1_TIME_to_tm(X509_get0_notAfter(certificate->get()), &parts) != 1) {
    return unusable("a certificate cannot be read", path, "its end is no date");
  }
  return std::chrono::system_clock::from_time_t(timegm(&parts));
}

}  // namespace hapticd::server
