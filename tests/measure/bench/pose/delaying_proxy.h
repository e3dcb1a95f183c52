#pragma once

#include <atomic>
#include <cstdint>
#include <string>
#include <thread>
#include <vector>

namespace hapticd::bench {

/// How long bytes take one way: at least, and up to so much more.
struct WayDelay {
  double least_ms = 0.0;
  double more_ms = 0.0;
};

/// A loopback port behind which another one lies, further away: what goes either way is delayed. For one
/// connection at a time, and for traffic of questions and answers: what arrives during a delay waits for its
/// end.
class DelayingProxy {
 public:
  /// Starts the proxy. Throws std::runtime_error if there is no port, or nothing listens on `target_port`.
  DelayingProxy(std::uint16_t target_port, WayDelay there, WayDelay back);
  ~DelayingProxy();
  DelayingProxy(const DelayingProxy&) = delete;
  DelayingProxy& operator=(const DelayingProxy&) = delete;

  std::string address() const { return "127.0.0.1:" + std::to_string(port_); }

 private:
  void serve();
  void pass_on(int from, int to, WayDelay delay);

  std::uint16_t target_port_;
  WayDelay there_;
  WayDelay back_;
  int listener_ = -1;
  std::uint16_t port_ = 0;
  std::atomic<bool> ending_{false};
  std::thread thread_;  // last: uses all of the above
};

}  // namespace hapticd::bench
