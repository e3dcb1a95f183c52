#include "server/config/identity_text.h"

#include <algorithm>
#include <cctype>

namespace hapticd::server {

namespace {

constexpr std::string_view kUser = "user:";
constexpr std::string_view kGroup = "unix:";
constexpr std::string_view kIdentities =
    "user:NAME, unix:GROUP, local, spiffe://LAB/hapticd/ROLE/NAME, serial:NUMBER (hexadecimal)";

bool is_part_of_name(char c) {
  return std::isspace(static_cast<unsigned char>(c)) == 0 &&
         std::iscntrl(static_cast<unsigned char>(c)) == 0 && c != ':' && c != '/';
}

bool is_local_name(std::string_view text) {
  return !text.empty() && std::all_of(text.begin(), text.end(), is_part_of_name);
}

/// Scheme, "://" and something without white space.
bool is_uri(std::string_view text) {
  const std::size_t scheme = text.find("://");
  if (scheme == std::string_view::npos || scheme == 0 || scheme + 3 == text.size()) return false;
  const auto is_visible = [](char c) {
    return std::isspace(static_cast<unsigned char>(c)) == 0 &&
           std::iscntrl(static_cast<unsigned char>(c)) == 0;
  };
  return is_local_name(text.substr(0, scheme)) && std::all_of(text.begin(), text.end(), is_visible);
}

hal::Error not_an_identity(std::string what, std::string_view text, std::string limit, std::string remedy) {
  return hal::Error::of(hal::ErrorCode::kMalformed, std::move(what), "", std::string(text), std::move(limit),
                        std::move(remedy));
}

/// The number of a certificate as OpenSSL writes it in capitals: an even count of digits, a zero before an
/// odd one. Empty if it is not a number.
std::string serial_digits(std::string_view text) {
  std::string digits;
  if (text.starts_with("0x") || text.starts_with("0X")) text.remove_prefix(2);
  for (const char c : text) {
    if (c == ':') continue;
    if (std::isxdigit(static_cast<unsigned char>(c)) == 0) return {};
    digits += static_cast<char>(std::toupper(static_cast<unsigned char>(c)));
  }
  if (digits.empty()) return {};
  digits.erase(0, std::min(digits.find_first_not_of('0'), digits.size()));
  if (digits.empty()) return "0";
  return digits.size() % 2 == 0 ? digits : "0" + digits;
}

}  // namespace

hal::Result<std::string> denied_identity(std::string_view text, const std::string& key) {
  constexpr std::size_t kSerial = std::string_view("serial:").size();
  if (text.starts_with("serial:") || text.starts_with("serial=")) {
    std::string digits = serial_digits(text.substr(kSerial));
    if (!digits.empty()) return "serial:" + std::move(digits);
    return not_an_identity(key + " is not the number of a certificate", text,
                           "serial: and hexadecimal digits",
                           "openssl x509 -serial -noout -in client.crt shows it");
  }
  const bool is_identity = text == "local" || is_uri(text) ||
                           (text.starts_with(kUser) && is_local_name(text.substr(kUser.size()))) ||
                           (text.starts_with(kGroup) && is_local_name(text.substr(kGroup.size())));
  if (is_identity) return std::string(text);
  return not_an_identity(key + " is not an identity: it would deny no client", text, std::string(kIdentities),
                         is_local_name(text)
                             ? "for the user of this machine write \"user:" + std::string(text) + "\""
                             : "write it as hapticctl access shows it to that client");
}

hal::Result<std::string> local_name(std::string_view text, const std::string& key) {
  if (is_local_name(text)) return std::string(text);
  const bool is_prefixed = text.starts_with(kUser) && is_local_name(text.substr(kUser.size()));
  return not_an_identity(
      key + " cannot be a name on this machine", text, "a name without ':', '/' and white space",
      is_prefixed ? "write " + std::string(text.substr(kUser.size()))
                  : "names of certificates belong in [access.certificates], others are as id prints them");
}

hal::Result<std::string> certificate_uri(std::string_view text, const std::string& key) {
  if (is_uri(text)) return std::string(text);
  return not_an_identity(
      key + " cannot be a name in a certificate", text, "spiffe://LAB/hapticd/ROLE/NAME",
      "openssl x509 -ext subjectAltName -noout -in client.crt shows it, after URI:; users of "
      "this machine belong in [access.users]");
}

}  // namespace hapticd::server
