#include "client/console/access/request_guard.h"

#include <algorithm>
#include <cctype>

namespace hapticd::console {

namespace {

constexpr unsigned kForbidden = 403;
constexpr unsigned kMisdirected = 421;
constexpr unsigned kUnsupportedType = 415;
constexpr std::size_t kMaxShown = 80;

std::string lower(std::string_view text) {
  std::string result(text);
  std::transform(result.begin(), result.end(), result.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return result;
}

/// Text without what could spoil a log or a page.
std::string shown(std::string_view text) {
  std::string result(text.substr(0, kMaxShown));
  std::replace_if(
      result.begin(), result.end(), [](unsigned char c) { return c < 0x20 || c > 0x7e || c == '<'; }, '?');
  return result;
}

bool is_port(std::string_view text) {
  return !text.empty() && text.size() <= 5 &&
         std::all_of(text.begin(), text.end(), [](char c) { return c >= '0' && c <= '9'; });
}

}  // namespace

RequestGuard::RequestGuard(std::vector<std::string> names, bool is_tls)
    : names_(std::move(names)), scheme_(is_tls ? "https://" : "http://") {
  for (const char* own : {"127.0.0.1", "[::1]", "localhost"}) names_.emplace_back(own);
  for (std::string& name : names_) {
    name = lower(name);
    if (name.find(':') != std::string::npos && !name.starts_with('[')) name = "[" + name + "]";
  }
}

bool RequestGuard::is_own(std::string_view host) const {
  const std::string name = lower(host);
  return std::any_of(names_.begin(), names_.end(), [&](const std::string& own) {
    if (!name.starts_with(own)) return false;
    // Any port: a tunnel shows its own.
    const std::string_view rest = std::string_view(name).substr(own.size());
    return rest.empty() || (rest.front() == ':' && is_port(rest.substr(1)));
  });
}

std::optional<RequestRefusal> RequestGuard::check(const RequestOrigin& from) const {
  if (!is_own(from.host)) {
    return RequestRefusal{kMisdirected,
                          "'" + shown(from.host) +
                              "' is no name of this machine that the console knows: open it as "
                              "localhost, or add the name to names of the console's configuration"};
  }
  if (!from.origin.empty() && lower(from.origin) != scheme_ + lower(from.host)) {
    return RequestRefusal{kForbidden, "requests of another site are refused: '" + shown(from.origin) + "'"};
  }
  return std::nullopt;
}

std::optional<RequestRefusal> RequestGuard::check_post(const RequestOrigin& from) const {
  if (!from.fetch_site.empty() && from.fetch_site != "same-origin") {
    return RequestRefusal{kForbidden, "requests of another site are refused"};
  }
  const std::string type = lower(from.content_type.substr(0, from.content_type.find(';')));
  if (type != "application/json") {
    return RequestRefusal{kUnsupportedType, "the content type must be application/json"};
  }
  if (from.console_header != "1") return RequestRefusal{kForbidden, "the header X-Hapticd: 1 is missing"};
  return std::nullopt;
}

std::optional<RequestRefusal> RequestGuard::check_socket(const RequestOrigin& from) const {
  if (from.origin.empty()) return RequestRefusal{kForbidden, "the header Origin is missing"};
  if (!from.fetch_site.empty() && from.fetch_site != "same-origin") {
    return RequestRefusal{kForbidden, "sockets of another site are refused"};
  }
  return std::nullopt;
}

std::string_view cookie_value(std::string_view header, std::string_view name) {
  while (!header.empty()) {
    const std::size_t end = std::min(header.find(';'), header.size());
    std::string_view pair = header.substr(0, end);
    header.remove_prefix(std::min(end + 1, header.size()));
    while (!pair.empty() && pair.front() == ' ') pair.remove_prefix(1);
    const std::size_t equals = pair.find('=');
    if (equals != std::string_view::npos && pair.substr(0, equals) == name) return pair.substr(equals + 1);
  }
  return {};
}

}  // namespace hapticd::console
