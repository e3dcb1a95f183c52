#pragma once

#include <chrono>
#include <map>
#include <string>

#include "hal/lock/callback.h"
#include "hal/lock/mutex.h"
#include "server/access/identity.h"
#include "server/access/role_policy.h"

namespace hapticd::server {

/// Metadata of the calls that a console makes for a person: the identity by its name, the serial number of
/// the certificate that the person's browser has shown, and the address of the browser, for the log.
inline constexpr const char* kOnBehalfKey = "hapticd-on-behalf-of";
inline constexpr const char* kOnBehalfSerialKey = "hapticd-on-behalf-of-serial";
inline constexpr const char* kBrowserKey = "hapticd-browser";

/// Identities by the names that the log has for them, with the roles of the configuration. All functions may
/// be called by any thread.
class NamedIdentities {
 public:
  /// The user of a name with its groups; slow, if the names are those of a directory in the network.
  using LookUp = Callback<LocalUser(const std::string& name)>;

  explicit NamedIdentities(const RolePolicy& policy);
  NamedIdentities(const RolePolicy& policy, LookUp look_up);

  /// `name`: as Identity::name. `serial`: of a certificate, in hexadecimal digits, else empty. No other
  /// thread waits while a user is looked up, and what was found counts for a minute.
  Identity find(const std::string& name, const std::string& serial);

 private:
  LocalUser user_of(const std::string& name);

  const RolePolicy& policy_;
  const LookUp look_up_;
  Mutex mutex_;
  std::map<std::string, LocalUser> known_ GUARDED_BY(mutex_);
  std::chrono::steady_clock::time_point forget_at_ GUARDED_BY(mutex_){};
};

}  // namespace hapticd::server
