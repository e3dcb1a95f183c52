#include "client/cpp/stop/late_stop.h"

#include <poll.h>
#include <sys/eventfd.h>
#include <unistd.h>

#include "client/cpp/error.h"
#include "client/cpp/stop/stop_port.h"

namespace hapticd::client {

LateStop::LateStop(const ClientOptions& options) : cancelled_(eventfd(0, EFD_CLOEXEC)) {
  thread_ = std::thread([options, cancelled = cancelled_] {
    pthread_setname_np(pthread_self(), "late-stop");
    pollfd watched{cancelled, POLLIN, 0};
    if (poll(&watched, 1, static_cast<int>(kDelay.count())) != 0) return;
    try {
      stop_by_stop_port(options.address, options.certificates, options.timeout, cancelled);
    } catch (const Error&) {
      // The call reports its own problem.
    }
  });
}

LateStop::~LateStop() {
  eventfd_write(cancelled_, 1);
  thread_.join();
  close(cancelled_);
}

}  // namespace hapticd::client
