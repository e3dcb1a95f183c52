#include "server/access/named_identities.h"

#include <string_view>
#include <utility>

#include "server/access/local_user.h"

namespace hapticd::server {

namespace {

constexpr std::string_view kUser = "user:";
constexpr std::chrono::seconds kKept{60};
constexpr std::size_t kMaxKnown = 1024;

LocalUser user_of_name(const std::string& name) {
  const auto id = user_id(name);
  return id ? user_of_id(*id) : LocalUser{name, {}};
}

}  // namespace

NamedIdentities::NamedIdentities(const RolePolicy& policy) : NamedIdentities(policy, user_of_name) {}

NamedIdentities::NamedIdentities(const RolePolicy& policy, LookUp look_up)
    : policy_(policy), look_up_(std::move(look_up)) {}

LocalUser NamedIdentities::user_of(const std::string& name) {
  const auto now = std::chrono::steady_clock::now();
  {
    const MutexLock lock(mutex_);
    if (now >= forget_at_ || known_.size() > kMaxKnown) {
      known_.clear();
      forget_at_ = now + kKept;
    }
    if (const auto found = known_.find(name); found != known_.end()) return found->second;
  }
  LocalUser user = look_up_(name);
  const MutexLock lock(mutex_);
  return known_.insert_or_assign(name, std::move(user)).first->second;
}

Identity NamedIdentities::find(const std::string& name, const std::string& serial) {
  if (name.starts_with(kUser)) return policy_.of_user(user_of(name.substr(kUser.size())));
  if (name == "local") return policy_.of_user({});
  Identity identity = policy_.of_certificate(name, serial);
  identity.is_console = false;  // a browser is a person
  return identity;
}

}  // namespace hapticd::server
