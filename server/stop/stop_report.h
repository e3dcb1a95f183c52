#pragma once

#include <array>
#include <cstdint>
#include <string_view>

namespace hapticd::server {

/// Path by which a stop came.
enum class StopPath : std::uint8_t { kSignal, kDatagram, kLoopback, kTls };

/// A stop, or an attempt, for the log: handed from the thread that served it to the one that may wait.
struct StopReport {
  StopPath path = StopPath::kSignal;
  bool was_refused = false;
  bool has_user = false;
  std::uint32_t user = 0;        ///< of this machine
  std::int32_t process = 0;      ///< 0: not known
  std::uint64_t last_tick = 0;   ///< see SafetyLatch::stop()
  std::int64_t unix_ns = 0;      ///< when it was served
  std::array<char, 160> name{};  ///< of a certificate; cut, and ends with 0
  std::array<char, 64> peer{};   ///< address
};

/// "a signal", "the datagram socket", "the stop port", "the stop port with certificates".
std::string_view to_text(StopPath path);

}  // namespace hapticd::server
