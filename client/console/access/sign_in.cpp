#include "client/console/access/sign_in.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <openssl/crypto.h>
#include <openssl/evp.h>
#include <openssl/hmac.h>
#include <spdlog/spdlog.h>
#include <sys/random.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <stdexcept>
#include <utility>

namespace hapticd::console {

namespace {

constexpr std::size_t kSecretSize = 32;
constexpr std::size_t kMaxCookie = 1024;

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

/// True if a file is this user's own, and closed to all others.
bool is_private(int file) {
  struct stat status {};
  return fstat(file, &status) == 0 && S_ISREG(status.st_mode) && status.st_uid == geteuid() &&
         (status.st_mode & 0077U) == 0;
}

/// The secret of the last run, or a new one that is left in the file for the next.
std::string secret_in(const std::string& path) {
  std::string secret(kSecretSize, '\0');
  if (path.empty()) return random_bytes(kSecretSize);
  const int existing = open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NOFOLLOW | O_NONBLOCK);
  if (existing >= 0) {
    const bool is_ours = is_private(existing);
    const bool whole =
        is_ours && read(existing, secret.data(), kSecretSize) == static_cast<ssize_t>(kSecretSize);
    close(existing);
    if (whole) return secret;
    if (!is_ours) {
      spdlog::warn(
          "{} could be read by others: a new one takes its place, and browsers have to sign in again", path);
    }
    unlink(path.c_str());
  }
  secret = random_bytes(kSecretSize);
  const int created = open(path.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC | O_NOFOLLOW, 0600);
  const bool written =
      created >= 0 && write(created, secret.data(), kSecretSize) == static_cast<ssize_t>(kSecretSize);
  if (created >= 0) close(created);
  if (!written) {
    spdlog::warn("browsers will have to sign in again when the console restarts: cannot write {}", path);
  }
  return secret;
}

/// "1000", or "-" for a user that is not known.
std::string in_words(SignIn::User user) {
  return user ? std::to_string(*user) : "-";
}

/// The text up to the next space, which is taken off.
std::string_view next_word(std::string_view& text) {
  const std::string_view word = text.substr(0, text.find(' '));
  text.remove_prefix(std::min(word.size() + 1, text.size()));
  return word;
}

}  // namespace

std::string new_key() {
  return in_hex(random_bytes(16));
}

SignIn::SignIn(const std::string& folder, std::chrono::seconds cookie_life, std::uint16_t port, Clock clock)
    : cookie_life_(cookie_life),
      port_(port),
      clock_(std::move(clock)),
      secret_(secret_in(folder.empty() ? folder : folder + "/console.key")) {}

std::string SignIn::signed_text(const std::string& payload) const {
  std::array<unsigned char, EVP_MAX_MD_SIZE> mac{};
  unsigned length = 0;
  HMAC(EVP_sha256(), secret_.data(), static_cast<int>(secret_.size()),
       reinterpret_cast<const unsigned char*>(payload.data()), payload.size(), mac.data(), &length);
  return in_hex(payload) + "." + in_hex({reinterpret_cast<const char*>(mac.data()), length});
}

std::string SignIn::cookie_for(const std::string& name, User user) const {
  const auto until =
      std::chrono::duration_cast<std::chrono::seconds>(clock_().time_since_epoch()) + cookie_life_;
  return signed_text(fmt::format("{} {} {} {}", until.count(), port_, in_words(user), name));
}

std::shared_ptr<const Session> SignIn::session_of(std::string_view cookie, User user) const {
  const std::size_t dot = cookie.find('.');
  if (cookie.size() > kMaxCookie || dot == std::string_view::npos) return nullptr;
  const auto payload = from_hex(cookie.substr(0, dot));
  if (!payload) return nullptr;
  const std::string expected = signed_text(*payload);
  if (expected.size() != cookie.size() || CRYPTO_memcmp(expected.data(), cookie.data(), cookie.size()) != 0) {
    return nullptr;
  }
  std::string_view rest = *payload;
  const std::string_view until_text = next_word(rest);
  std::int64_t until = 0;
  std::from_chars(until_text.data(), until_text.data() + until_text.size(), until);
  if (std::chrono::seconds(until) <= clock_().time_since_epoch()) return nullptr;
  if (next_word(rest) != std::to_string(port_)) return nullptr;
  // In a container the kernel shows no user, neither at the sign-in nor later.
  const std::string_view owner = next_word(rest);
  if (owner != "-" && owner != in_words(user)) return nullptr;
  if (rest.empty()) return nullptr;
  return std::make_shared<const Session>(Session{std::string(rest), {}});
}

}  // namespace hapticd::console
