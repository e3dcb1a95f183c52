#pragma once

#include <array>
#include <cstdint>
#include <string_view>

namespace hapticd::server {

/// The one message that stops without gRPC, and its answers, all of a fixed size. proto/README.md has them.
/// Over TCP and TLS what begins so stops, whatever follows; as a datagram every message stops but an answer.
inline constexpr std::string_view kStopRequest = "HAPTICD STOP 1\n";
inline constexpr std::string_view kStopWord = "HAPTICD STOP";

using StopAnswer = std::array<char, 33>;
/// "HAPTICD STOPPED 000000000001e240\n": with the last tick that was completed when the stop was handed to
/// the loop.
StopAnswer stopped_answer(std::uint64_t last_tick) noexcept;
/// "HAPTICD REFUSED 0000000000000000\n": it is denied, or was not a stop.
StopAnswer refused_answer() noexcept;
/// Whether a message is such an answer. To answer it would make two daemons, or one whose own name a sender
/// has taken, talk for ever.
bool is_answer(std::string_view message) noexcept;

}  // namespace hapticd::server
