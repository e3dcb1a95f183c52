#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace hapticd::console {

/// What a request shows of where it comes from. Empty: the header is absent.
struct RequestOrigin {
  std::string_view host;            ///< Host
  std::string_view origin;          ///< Origin
  std::string_view fetch_site;      ///< Sec-Fetch-Site
  std::string_view content_type;    ///< Content-Type
  std::string_view console_header;  ///< X-Hapticd
};

/// Why a request is refused.
struct RequestRefusal {
  unsigned http_status;
  std::string why;
};

/// Keeps out what another site makes a browser send.
class RequestGuard {
 public:
  /// `names`: further names of this machine. `is_tls`: pages have the scheme https.
  RequestGuard(std::vector<std::string> names, bool is_tls);

  /// Checks every request: the host must be one of this machine's own names (a page of another site whose
  /// name was made to point here shows its own), and an origin, if one is sent, this very page's.
  std::optional<RequestRefusal> check(const RequestOrigin& from) const;
  /// Checks requests that change something, as well: only a page of the same origin can send this type and
  /// header.
  std::optional<RequestRefusal> check_post(const RequestOrigin& from) const;
  /// Checks a socket, as well: browsers send its origin always, and open it without asking first.
  std::optional<RequestRefusal> check_socket(const RequestOrigin& from) const;

 private:
  bool is_own(std::string_view host) const;
  std::vector<std::string> names_;
  std::string scheme_;
};

/// Value of a cookie in a Cookie header; empty if it is not there.
std::string_view cookie_value(std::string_view header, std::string_view name);

}  // namespace hapticd::console
