#include "hal/netft/netft_http.h"

#include <httplib.h>
#include <pthread.h>

#include <thread>

#include "hal/lock/mutex.h"

namespace hapticd::netft {

namespace {

using Clock = std::chrono::steady_clock;

/// Ends a client's request when the time is over or its result is not wanted any more. The library's own
/// time-outs are per read, so that a server that drips could hold it for ever. stop() is called again and
/// again: while the client still connects it has no effect.
class Watchdog {
 public:
  Watchdog(httplib::Client& client, Clock::time_point deadline, std::stop_token cancel)
      : thread_([this, &client, deadline, cancel = std::move(cancel)] {
          pthread_setname_np(pthread_self(), "netft-http");
          MutexLock lock(mutex_);
          while (!done_) {
            condition_.wait_for(mutex_, std::chrono::milliseconds(20));
            if (done_ || (Clock::now() < deadline && !cancel.stop_requested())) continue;
            fired_ = true;
            lock.unlock();
            client.stop();
            lock.lock();
          }
        }) {}
  ~Watchdog() { finish(); }
  Watchdog(const Watchdog&) = delete;
  Watchdog& operator=(const Watchdog&) = delete;

  /// True if it had to end the request.
  bool finish() {
    {
      const MutexLock lock(mutex_);
      done_ = true;
    }
    condition_.notify_one();
    if (thread_.joinable()) thread_.join();
    const MutexLock lock(mutex_);
    return fired_;
  }

 private:
  Mutex mutex_;
  Condition condition_;
  bool done_ GUARDED_BY(mutex_) = false;
  bool fired_ GUARDED_BY(mutex_) = false;
  std::thread thread_;
};

}  // namespace

hal::Result<std::string> fetch_page(const std::string& address, int port, const std::string& path,
                                    Clock::time_point deadline, std::size_t max_bytes,
                                    const std::stop_token& cancel) {
  const std::string where = "http://" + address + ":" + std::to_string(port) + path;
  const auto refusal = [&where](std::string what, std::string value) {
    return hal::Error{.what = std::move(what),
                      .where = where,
                      .value = std::move(value),
                      .limit = {},
                      .remedy =
                          "check the box's power, cable and address (open this address in a browser), or "
                          "set read_configuration = false and set counts and units by hand"};
  };
  const auto left = std::chrono::duration_cast<std::chrono::microseconds>(deadline - Clock::now());
  if (left.count() <= 0) return refusal("no time was left to ask the box", "");

  httplib::Client client(address, port);
  client.set_connection_timeout(left);
  // Later than the deadline of the watchdog, which ends the request.
  client.set_read_timeout(left + std::chrono::seconds(1));
  client.set_write_timeout(left + std::chrono::seconds(1));
  client.set_follow_location(false);
  client.set_keep_alive(false);
  // No compressed content: its length could not be bounded.
  const httplib::Headers headers{{"Accept-Encoding", "identity"}};

  std::string body;
  bool too_long = false;
  Watchdog watchdog(client, deadline, cancel);
  const httplib::Result result = client.Get(path, headers, [&](const char* data, std::size_t length) {
    too_long = length > max_bytes - body.size();
    if (too_long) return false;
    body.append(data, length);
    return true;
  });
  const bool out_of_time = watchdog.finish();

  if (too_long) {
    return refusal("the page is too long for a box's configuration",
                   "more than " + std::to_string(max_bytes) + " bytes");
  }
  if (!result && (out_of_time || result.error() == httplib::Error::ConnectionTimeout)) {
    return refusal("the box did not answer over HTTP in time", "");
  }
  if (!result) {
    return refusal("the box does not answer over HTTP", httplib::to_string(result.error()) + " failed");
  }
  if (result->status != 200) {
    return refusal("the box has no such page", "HTTP status " + std::to_string(result->status));
  }
  return body;
}

}  // namespace hapticd::netft
