#include "server/access/unknown_names.h"

#include <fmt/format.h>

#include <algorithm>
#include <string_view>

#include "server/access/local_user.h"

namespace hapticd::server {

namespace {

bool is_number(std::string_view name) {
  return std::all_of(name.begin(), name.end(), [](char c) { return c >= '0' && c <= '9'; });
}

}  // namespace

std::vector<std::string> unknown_names(const AccessConfig& access) {
  std::vector<std::string> lines;
  const auto judge = [&lines](const char* place, const char* kind, const std::string& name, bool is_known) {
    if (is_known || is_number(name)) return;
    lines.push_back(fmt::format("{} names a {} that this machine does not know: {}", place, kind, name));
  };
  const auto judge_user = [&](const char* place, const std::string& name) {
    judge(place, "user", name, user_id(name).has_value());
  };
  const auto judge_group = [&](const char* place, const std::string& name) {
    judge(place, "group", name, group_id(name).has_value());
  };
  for (const auto& [name, role] : access.users) judge_user("[access.users]", name);
  for (const auto& [name, role] : access.groups) judge_group("[access.groups]", name);
  constexpr std::string_view kUser = "user:";
  constexpr std::string_view kGroup = "unix:";
  for (const auto& [identity, why] : access.denied) {
    if (identity.starts_with(kUser)) judge_user("[access.denied]", identity.substr(kUser.size()));
    if (identity.starts_with(kGroup)) judge_group("[access.denied]", identity.substr(kGroup.size()));
    const std::string& opens = access.unix_socket_group;
    if (identity.starts_with(kGroup) && !opens.empty() && identity.substr(kGroup.size()) != opens) {
      lines.push_back(
          fmt::format("[access.denied] names a group other than unix_socket_group = \"{}\", so it denies "
                      "no client: {}",
                      opens, identity));
    }
  }
  return lines;
}

}  // namespace hapticd::server
