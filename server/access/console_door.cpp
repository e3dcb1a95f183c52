#include "server/access/console_door.h"

#include <fcntl.h>
#include <openssl/crypto.h>
#include <openssl/evp.h>
#include <openssl/hmac.h>
#include <pwd.h>
#include <sys/random.h>
#include <unistd.h>

#include <array>
#include <charconv>
#include <stdexcept>
#include <utility>

#include "server/access/local_user.h"
#include "server/process/log.h"

namespace hapticd::server {

namespace {

constexpr std::size_t kSecretSize = 32;
constexpr std::size_t kMaxKeys = 256;
constexpr std::size_t kMaxSessions = 1024;
constexpr std::size_t kMaxCookie = 1024;
constexpr std::chrono::seconds kKeyLife{60};
constexpr std::string_view kUser = "user:";
constexpr std::string_view kUnix = "unix:";

std::string random_bytes(std::size_t size) {
  std::string bytes(size, '\0');
  if (getrandom(bytes.data(), size, 0) != static_cast<ssize_t>(size)) {
    throw std::runtime_error("the kernel gives no random bytes");
  }
  return bytes;
}

std::string in_hex(std::string_view bytes) {
  constexpr std::string_view kDigits = "0123456789abcdef";
  std::string text;
  for (const char c : bytes) {
    const auto byte = static_cast<unsigned char>(c);
    text += kDigits[byte >> 4U];
    text += kDigits[byte & 15U];
  }
  return text;
}

std::optional<std::string> from_hex(std::string_view text) {
  if (text.size() % 2 != 0) return std::nullopt;
  std::string bytes;
  for (std::size_t i = 0; i < text.size(); i += 2) {
    unsigned value = 0;
    const auto [end, failure] = std::from_chars(text.data() + i, text.data() + i + 2, value, 16);
    if (failure != std::errc{} || end != text.data() + i + 2) return std::nullopt;
    bytes += static_cast<char>(value);
  }
  return bytes;
}

/// The secret of the last run, or a new one that is left in the file for the next.
std::string secret_in(const std::string& path) {
  std::string secret(kSecretSize, '\0');
  if (path.empty()) return random_bytes(kSecretSize);
  const int existing = open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NOFOLLOW);
  if (existing >= 0) {
    const bool whole = read(existing, secret.data(), kSecretSize) == static_cast<ssize_t>(kSecretSize);
    close(existing);
    if (whole) return secret;
    unlink(path.c_str());
  }
  secret = random_bytes(kSecretSize);
  const int created = open(path.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC | O_NOFOLLOW, 0600);
  const bool written =
      created >= 0 && write(created, secret.data(), kSecretSize) == static_cast<ssize_t>(kSecretSize);
  if (created >= 0) close(created);
  if (!written)
    log_warning("browsers will have to sign in again when the daemon restarts: cannot write " + path);
  return secret;
}

LocalUser user_of_name(const std::string& name) {
  std::array<char, 16384> buffer{};
  passwd entry{};
  passwd* found = nullptr;
  if (getpwnam_r(name.c_str(), &entry, buffer.data(), buffer.size(), &found) != 0 || found == nullptr) {
    return {name, {}};
  }
  return user_of_id(found->pw_uid);
}

}  // namespace

ConsoleDoor::ConsoleDoor(const RolePolicy& policy, const std::string& folder,
                         std::chrono::seconds cookie_life, Clock clock)
    : policy_(policy),
      cookie_life_(cookie_life),
      clock_(std::move(clock)),
      secret_(secret_in(folder.empty() ? folder : folder + "/console.key")) {}

std::string ConsoleDoor::signed_text(const std::string& payload) const {
  std::array<unsigned char, EVP_MAX_MD_SIZE> mac{};
  unsigned length = 0;
  HMAC(EVP_sha256(), secret_.data(), static_cast<int>(secret_.size()),
       reinterpret_cast<const unsigned char*>(payload.data()), payload.size(), mac.data(), &length);
  return in_hex(payload) + "." + in_hex({reinterpret_cast<const char*>(mac.data()), length});
}

void ConsoleDoor::forget_old_keys() {
  const auto now = clock_();
  std::erase_if(keys_, [&](const auto& entry) { return entry.second.until <= now; });
}

std::string ConsoleDoor::issue_key(const Identity& who) {
  std::string key = in_hex(random_bytes(16));
  const std::lock_guard lock(mutex_);
  forget_old_keys();
  if (keys_.size() >= kMaxKeys) return {};
  keys_[key] = {who.name, clock_() + kKeyLife};
  return key;
}

std::optional<std::string> ConsoleDoor::redeem(std::string_view key) {
  std::string name;
  {
    const std::lock_guard lock(mutex_);
    forget_old_keys();
    const auto found = keys_.find(key);
    if (found == keys_.end()) return std::nullopt;
    name = found->second.name;
    keys_.erase(found);
  }
  const auto until =
      std::chrono::duration_cast<std::chrono::seconds>(clock_().time_since_epoch()) + cookie_life_;
  return signed_text(std::to_string(until.count()) + " " + name);
}

Identity ConsoleDoor::identity_of(const std::string& name) const {
  if (name.starts_with(kUnix)) return policy_.of_unix_socket(name.substr(kUnix.size()));
  if (name.starts_with(kUser)) return policy_.of_user(user_of_name(name.substr(kUser.size())));
  if (name == "local") return policy_.of_user({});
  return policy_.of_certificate(name, {});
}

std::shared_ptr<const ConsoleDoor::Session> ConsoleDoor::session_of(std::string_view cookie) {
  const std::size_t dot = cookie.find('.');
  if (cookie.size() > kMaxCookie || dot == std::string_view::npos) return nullptr;
  const auto payload = from_hex(cookie.substr(0, dot));
  if (!payload) return nullptr;
  const std::string expected = signed_text(*payload);
  if (expected.size() != cookie.size() || CRYPTO_memcmp(expected.data(), cookie.data(), cookie.size()) != 0) {
    return nullptr;
  }
  const std::size_t space = payload->find(' ');
  std::int64_t until = 0;
  std::from_chars(payload->data(), payload->data() + std::min(space, payload->size()), until);
  if (space == std::string::npos || std::chrono::seconds(until) <= clock_().time_since_epoch())
    return nullptr;
  const std::string name = payload->substr(space + 1);
  {
    const std::lock_guard lock(mutex_);
    if (const auto known = sessions_.find(name); known != sessions_.end()) return known->second;
  }
  return enter(identity_of(name));
}

std::shared_ptr<const ConsoleDoor::Session> ConsoleDoor::session_of(const Identity& who) {
  {
    const std::lock_guard lock(mutex_);
    const auto known = sessions_.find(who.name);
    // Of two certificates with one name, one may be denied.
    if (known != sessions_.end() && known->second->who.is_denied == who.is_denied) return known->second;
  }
  return enter(who);
}

std::shared_ptr<const ConsoleDoor::Session> ConsoleDoor::enter(Identity who) {
  auto session = std::make_shared<const Session>(Session{std::move(who), in_hex(random_bytes(32))});
  const std::lock_guard lock(mutex_);
  if (sessions_.size() >= kMaxSessions) return nullptr;
  if (const auto old = sessions_.find(session->who.name); old != sessions_.end())
    passes_.erase(old->second->pass);
  sessions_[session->who.name] = session;
  passes_[session->pass] = session;
  return session;
}

std::optional<Identity> ConsoleDoor::holder_of(std::string_view pass) const {
  const std::lock_guard lock(mutex_);
  const auto found = passes_.find(pass);
  if (found == passes_.end()) return std::nullopt;
  return found->second->who;
}

}  // namespace hapticd::server
