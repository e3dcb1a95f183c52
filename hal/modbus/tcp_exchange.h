#pragma once

#include <chrono>
#include <cstdint>
#include <vector>

namespace hapticd::modbus {

/// Requests and their answers over Modbus TCP. An answer belongs to the request of its transaction number:
/// one that comes too late is recognized and discarded, so that the next request gets its own answer.
/// libmodbus takes whatever comes first.
class TcpExchange {
 public:
  using Bytes = std::vector<std::uint8_t>;

  /// Forgets what was received over an earlier connection.
  void reset() noexcept { received_.clear(); }
  /// Sends a request and waits for its answer; both are the function code and what follows it. Returns 0,
  /// ETIMEDOUT, EMBBADDATA for bytes that are not Modbus, or the errno of a broken connection.
  int exchange(int socket, int unit, const Bytes& request, double timeout_s, Bytes& answer);
  /// Answers that were discarded because they came too late.
  std::uint64_t late_answers() const noexcept { return late_answers_; }

 private:
  using Clock = std::chrono::steady_clock;
  int send(int socket, const Bytes& frame, Clock::time_point deadline) const;
  int receive(int socket, Clock::time_point deadline);
  int discard_all(int socket);

  std::uint16_t transaction_ = 0;
  Bytes received_;  ///< not yet taken
  std::uint64_t late_answers_ = 0;
};

}  // namespace hapticd::modbus
