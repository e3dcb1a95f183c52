#pragma once

#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <mutex>
#include <thread>

namespace hapticd::server {

/// Holds the memory that clients can make this process take. gRPC 1.51 keeps some 30 kB for every call that
/// was opened and given up at once, until a thread has looked at it, and neither its limit of streams nor its
/// quota counts them: one connection makes gigabytes of that in seconds, and the end of the process by the
/// kernel, without a last zero. So the resident memory is looked at fifty times a second, and every
/// 2 ms while it grows; where it has grown by more than kMaxGrowth, the TCP connections that send the most
/// are closed. What they had opened is freed and given back.
class MemoryWatch {
 public:
  static constexpr std::size_t kMaxGrowth = std::size_t{256} << 20U;  ///< bytes
  /// A connection that sends less than this in a second is not flooding.
  static constexpr std::uint64_t kMinFlood = 200'000;  ///< bytes

  /// From now on the connections to this port are watched.
  explicit MemoryWatch(std::uint16_t port, std::size_t max_growth_bytes = kMaxGrowth);
  ~MemoryWatch();
  MemoryWatch(const MemoryWatch&) = delete;
  MemoryWatch& operator=(const MemoryWatch&) = delete;

 private:
  void run();

  const std::uint16_t port_;
  const std::size_t max_growth_;
  std::mutex mutex_;
  std::condition_variable ending_signal_;
  bool ending_ = false;
  std::thread thread_;  // last: uses all of the above
};

}  // namespace hapticd::server
