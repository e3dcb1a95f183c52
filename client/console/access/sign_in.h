#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

namespace hapticd::console {

/// A browser that is signed in.
struct Session {
  std::string name;    ///< the identity, as the daemon names it
  std::string serial;  ///< of the certificate that it has shown, else empty
};

/// Makes and checks the cookies of browsers that have no certificate. A cookie names, under a signature, the
/// identity, until when it counts, the console's port, and the user of this machine whose program got it.
/// Browsers show a cookie to every port of a host: a cookie that came to another program is worth nothing to
/// the program of another user, nor at another console.
///
/// The secret of the signatures is in a file: a browser stays signed in when the console starts again. Delete
/// the file to sign out all. A file that others may read, or that another user owns, is replaced.
class SignIn {
 public:
  using Clock = std::function<std::chrono::system_clock::time_point()>;
  /// A user of this machine by number; nothing if the kernel does not show who made a connection.
  using User = std::optional<unsigned>;

  /// `folder`: of the secret, console.key. Empty, or one that cannot be written to: cookies end with the
  /// program.
  SignIn(const std::string& folder, std::chrono::seconds cookie_life, std::uint16_t port,
         Clock clock = std::chrono::system_clock::now);

  /// A cookie for the identity of this name, that a program of `user` may show.
  std::string cookie_for(const std::string& name, User user) const;
  /// The identity that a cookie names; nullptr if its signature is wrong, it is too old, or it was made for
  /// another port or user.
  std::shared_ptr<const Session> session_of(std::string_view cookie, User user) const;

 private:
  std::string signed_text(const std::string& payload) const;

  const std::chrono::seconds cookie_life_;
  const std::uint16_t port_;
  const Clock clock_;
  const std::string secret_;
};

/// 128 random bits as text: a key that only who was given it can know.
std::string new_key();

}  // namespace hapticd::console
