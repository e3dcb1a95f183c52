#include "server/access/console_registry.h"

#include <fmt/format.h>
#include <sys/random.h>

#include <array>
#include <stdexcept>
#include <utility>

namespace hapticd::server {

namespace {

constexpr std::size_t kMaxKeys = 256;
/// Maximum number of keys of one identity: it must not use up those of the others.
constexpr std::size_t kMaxKeysEach = 8;
constexpr std::chrono::seconds kKeyLife{60};
constexpr std::chrono::seconds kReportLife{3};

/// 128 random bits.
std::string new_key() {
  std::array<unsigned char, 16> bytes{};
  if (getrandom(bytes.data(), bytes.size(), 0) != static_cast<ssize_t>(bytes.size())) {
    throw std::runtime_error("the kernel gives no random bytes");
  }
  std::string text;
  for (const unsigned char byte : bytes) text += fmt::format("{:02x}", byte);
  return text;
}

}  // namespace

void ConsoleRegistry::report(Urls urls) {
  const auto now = clock_();
  const MutexLock lock(mutex_);
  urls_ = std::move(urls);
  urls_until_ = now + kReportLife;
}

ConsoleRegistry::Urls ConsoleRegistry::urls() const {
  const auto now = clock_();
  const MutexLock lock(mutex_);
  return now < urls_until_ ? urls_ : Urls{};
}

void ConsoleRegistry::forget_old_keys(std::chrono::steady_clock::time_point now) {
  std::erase_if(keys_, [&](const auto& entry) { return entry.second.until <= now; });
}

/// Forgets the oldest keys of an identity, so that it may have one more.
void ConsoleRegistry::forget_surplus_of(const std::string& name) {
  std::size_t count = 0;
  auto oldest = keys_.end();
  for (auto one = keys_.begin(); one != keys_.end(); ++one) {
    if (one->second.name != name) continue;
    ++count;
    if (oldest == keys_.end() || one->second.until < oldest->second.until) oldest = one;
  }
  if (count >= kMaxKeysEach) keys_.erase(oldest);
}

std::string ConsoleRegistry::issue_key(const std::string& name) {
  std::string key = new_key();
  const auto now = clock_();
  const MutexLock lock(mutex_);
  forget_old_keys(now);
  forget_surplus_of(name);
  if (keys_.size() >= kMaxKeys) return {};
  keys_[key] = {name, now + kKeyLife};
  return key;
}

std::optional<std::string> ConsoleRegistry::redeem(std::string_view key) {
  const auto now = clock_();
  const MutexLock lock(mutex_);
  forget_old_keys(now);
  const auto found = keys_.find(key);
  if (found == keys_.end()) return std::nullopt;
  std::string name = std::move(found->second.name);
  keys_.erase(found);
  return name;
}

}  // namespace hapticd::server
