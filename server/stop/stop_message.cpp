#include "server/stop/stop_message.h"

#include <algorithm>

namespace hapticd::server {

namespace {

StopAnswer answer_of(std::string_view words, std::uint64_t number) noexcept {
  constexpr std::string_view kDigits = "0123456789abcdef";
  StopAnswer answer{};
  std::copy(words.begin(), words.end(), answer.begin());
  for (std::size_t i = 0; i < 16; ++i) answer[words.size() + i] = kDigits[(number >> (60U - 4U * i)) & 15U];
  answer.back() = '\n';
  return answer;
}

constexpr std::string_view kStopped = "HAPTICD STOPPED ";
constexpr std::string_view kRefused = "HAPTICD REFUSED ";
static_assert(kStopped.size() + 17 == std::tuple_size_v<StopAnswer> && kRefused.size() == kStopped.size());

}  // namespace

StopAnswer stopped_answer(std::uint64_t last_tick) noexcept {
  return answer_of(kStopped, last_tick);
}

StopAnswer refused_answer() noexcept {
  return answer_of(kRefused, 0);
}

bool is_answer(std::string_view message) noexcept {
  return message.starts_with(kStopped) || message.starts_with(kRefused);
}

}  // namespace hapticd::server
