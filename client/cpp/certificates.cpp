#include "client/cpp/certificates.h"

#include <arpa/inet.h>

#include <cstdlib>
#include <filesystem>
#include <string_view>
#include <vector>

#include "client/cpp/error.h"

namespace hapticd::client {
namespace {

constexpr std::string_view kTls = "tls:";
constexpr std::string_view kUnixSocket = "unix:";

std::string environment(const char* name) {
  const char* value = std::getenv(name);
  return value == nullptr ? std::string() : std::string(value);
}

/// Folders in which certificates may be, the first choice first.
std::vector<std::string> folders_for(const std::string& host) {
  if (const std::string named = environment("HAPTICD_CERTIFICATES"); !named.empty()) return {named};
  std::string base = environment("XDG_CONFIG_HOME");
  if (base.empty()) base = environment("HOME") + "/.config";
  base += "/hapticd/certificates";
  return {base + "/" + host, base};
}

bool is_loopback(const std::string& host) {
  if (host == "localhost") return true;
  in_addr v4{};
  if (inet_pton(AF_INET, host.c_str(), &v4) == 1) return (ntohl(v4.s_addr) >> 24U) == 127U;
  in6_addr v6{};
  return inet_pton(AF_INET6, host.c_str(), &v6) == 1 && IN6_IS_ADDR_LOOPBACK(&v6);
}

}  // namespace

std::string host_of(const std::string& address) {
  std::string_view text = address;
  if (text.starts_with(kTls)) text.remove_prefix(kTls.size());
  text = text.substr(0, text.rfind(':'));
  if (text.size() > 2 && text.front() == '[' && text.back() == ']') text = text.substr(1, text.size() - 2);
  return std::string(text);
}

std::string port_of(const std::string& address) {
  return address.substr(address.rfind(':') + 1);
}

bool needs_certificates(const std::string& address) {
  if (address.starts_with(kTls)) return true;
  return !address.starts_with(kUnixSocket) && !is_loopback(host_of(address));
}

CertificateFiles find_certificates(const std::string& address, const std::string& folder) {
  const std::vector<std::string> folders =
      folder.empty() ? folders_for(host_of(address)) : std::vector{folder};
  std::string chosen = folders.back();
  std::string looked_in;
  for (const std::string& one : folders) {
    std::error_code ignored;
    if (std::filesystem::is_regular_file(one + "/client.crt", ignored)) {
      chosen = one;
      break;
    }
    looked_in += (looked_in.empty() ? "" : ", ") + one;
  }
  const CertificateFiles files{chosen + "/client.crt", chosen + "/client.key", chosen + "/authority.crt"};
  for (const std::string& file : {files.certificate, files.key, files.authority}) {
    std::error_code ignored;
    if (std::filesystem::is_regular_file(file, ignored)) continue;
    v1::ErrorDetail detail;
    detail.set_what("there is no certificate for this daemon");
    detail.set_where(file);
    detail.set_value(address);
    detail.set_limit("client.crt, client.key and authority.crt in " +
                     (looked_in.empty() ? chosen : looked_in));
    detail.set_remedy("ask a maintainer of the rig for them, see docs/access.md");
    throw Error(ErrorKind::kBadAddress, "", detail);
  }
  return files;
}

}  // namespace hapticd::client
