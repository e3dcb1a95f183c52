#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>

#include "server/access/identity.h"
#include "server/access/role_policy.h"

namespace hapticd::server {

/// Who a browser is. A client that is identified already asks for a key that works once; the browser that
/// shows it gets a cookie, and is that client from then on, with the role the client has. Calls of the
/// console reach the service through a channel within the process: a pass that never leaves the process names
/// the client to the gate.
///
/// A cookie holds the name of the client and until when it counts, under a signature. The secret it is signed
/// with is in a file: a browser stays signed in when the daemon starts again. Delete the file to sign out
/// all. All functions may be called by any thread.
class ConsoleDoor {
 public:
  using Clock = std::function<std::chrono::system_clock::time_point()>;
  struct Session {
    Identity who;
    std::string pass;  ///< secret; for AccessGate
  };

  /// `folder`: of the secret, console.key. Empty, or one that cannot be written to: cookies end with the
  /// daemon.
  ConsoleDoor(const RolePolicy& policy, const std::string& folder, std::chrono::seconds cookie_life,
              Clock clock = std::chrono::system_clock::now);

  /// A key for a browser of this client. Works once, for a minute. Empty: too many are open.
  std::string issue_key(const Identity& who);
  /// The cookie for a key; nothing where the key is unknown, used or too old.
  std::optional<std::string> redeem(std::string_view key);
  /// The client a cookie names; nothing where its signature is wrong or it is too old.
  std::shared_ptr<const Session> session_of(std::string_view cookie);
  /// The session of a client that its connection names (a certificate).
  std::shared_ptr<const Session> session_of(const Identity& who);

  /// For AccessGate: the client behind a pass.
  std::optional<Identity> holder_of(std::string_view pass) const;

 private:
  struct Key {
    std::string name;
    std::chrono::system_clock::time_point until;
  };
  std::string signed_text(const std::string& payload) const;
  std::shared_ptr<const Session> enter(Identity who);
  Identity identity_of(const std::string& name) const;
  void forget_old_keys();

  const RolePolicy& policy_;
  const std::chrono::seconds cookie_life_;
  const Clock clock_;
  std::string secret_;

  mutable std::mutex mutex_;
  std::map<std::string, Key, std::less<>> keys_;
  std::map<std::string, std::shared_ptr<const Session>, std::less<>> sessions_;  ///< by the identity's name
  std::map<std::string, std::shared_ptr<const Session>, std::less<>> passes_;
};

}  // namespace hapticd::server
