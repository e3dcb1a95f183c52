#include "server/stop/stop_rights.h"

#include <algorithm>
#include <string_view>

#include "server/access/local_user.h"

namespace hapticd::server {

StopRights::StopRights(const RolePolicy& policy, const std::string& unix_group)
    : policy_(policy), denies_unix_group_(policy.config().denied.contains("unix:" + unix_group)) {
  constexpr std::string_view kUser = "user:";
  for (const auto& [identity, why] : policy.config().denied) {
    if (identity == "local") denies_users_ = true;
    if (!identity.starts_with(kUser)) continue;
    denies_users_ = true;
    const std::string name = identity.substr(kUser.size());
    if (const auto id = user_id(name)) denied_.push_back(*id);
  }
}

bool StopRights::user_may_stop(std::optional<unsigned> user) const noexcept {
  if (!user) return !denies_users_;
  return std::find(denied_.begin(), denied_.end(), *user) == denied_.end();
}

bool StopRights::unix_user_may_stop(std::optional<unsigned> user) const noexcept {
  return !denies_unix_group_ && user_may_stop(user);
}

bool StopRights::certificate_may_stop(const std::string& uri, const std::string& serial) const {
  return !policy_.of_certificate(uri, serial).is_denied;
}

}  // namespace hapticd::server
