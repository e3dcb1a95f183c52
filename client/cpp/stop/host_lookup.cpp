#include "client/cpp/stop/host_lookup.h"

#include <poll.h>
#include <pthread.h>
#include <sys/eventfd.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <system_error>
#include <thread>

namespace hapticd::client {
namespace {

/// Fills `found` with the addresses, or with the problem.
void ask(const std::string& host, const std::string& port, int flags, HostAddresses& found) {
  addrinfo hints{};
  hints.ai_socktype = SOCK_STREAM;
  hints.ai_flags = flags;
  addrinfo* first = nullptr;
  const int failure = getaddrinfo(host.c_str(), port.c_str(), &hints, &first);
  if (failure != 0) {
    found.problem = gai_strerror(failure);
  } else {
    found.first = {first, freeaddrinfo};
  }
}

/// One look-up, which its thread and the one who waits own together.
struct LookUp {
  ~LookUp() { close(done); }

  HostAddresses found{};
  std::atomic<bool> is_over{false};    ///< then `found` changes no more
  int done = eventfd(0, EFD_CLOEXEC);  ///< wakes up the one who waits
};

}  // namespace

HostAddresses look_up(const std::string& host, const std::string& port,
                      std::chrono::steady_clock::time_point until, int cancelled) {
  HostAddresses in_numbers;
  ask(host, port, AI_NUMERICHOST, in_numbers);
  if (in_numbers.first) return in_numbers;
  const auto shared = std::make_shared<LookUp>();
  const auto run = [shared, host, port] {
    pthread_setname_np(pthread_self(), "stop-lookup");
    ask(host, port, 0, shared->found);
    shared->is_over = true;
    eventfd_write(shared->done, 1);
  };
  try {
    std::thread(run).detach();
  } catch (const std::system_error&) {  // no further thread: then this one waits
    ask(host, port, 0, shared->found);
    return shared->found;
  }
  while (!shared->is_over) {
    const auto left = std::chrono::ceil<std::chrono::milliseconds>(until - std::chrono::steady_clock::now());
    if (left.count() <= 0) return {};
    std::array<pollfd, 2> watched{{{shared->done, POLLIN, 0}, {cancelled, POLLIN, 0}}};
    if (poll(watched.data(), watched.size(), static_cast<int>(left.count())) <= 0) continue;
    if (watched[1].revents != 0 && !shared->is_over) return {};
  }
  return shared->found;
}

}  // namespace hapticd::client
