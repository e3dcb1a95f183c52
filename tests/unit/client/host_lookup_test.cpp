// Looking up a name for a stop, while the system's own look-up hangs.

#include "client/cpp/stop/host_lookup.h"

#include <dlfcn.h>
#include <gtest/gtest.h>
#include <netdb.h>
#include <sys/eventfd.h>
#include <unistd.h>

#include <atomic>
#include <chrono>
#include <string_view>

#include "client/cpp/error.h"
#include "client/cpp/stop/stop_port.h"
#include "tests/support/value_of.h"

namespace {

constexpr const char* kUnknownName = "no.such.name";
std::atomic<bool> hangs{false};

}  // namespace

// In place of the system's in this program, which it calls.
extern "C" int getaddrinfo(const char* host, const char* port, const addrinfo* hints, addrinfo** found) {
  const bool asks_a_server = hints == nullptr || (hints->ai_flags & AI_NUMERICHOST) == 0;
  if (asks_a_server) hangs.wait(true);
  if (asks_a_server && host != nullptr && std::string_view(host) == kUnknownName) return EAI_AGAIN;
  static const auto of_the_system = reinterpret_cast<decltype(&getaddrinfo)>(dlsym(RTLD_NEXT, "getaddrinfo"));
  return of_the_system(host, port, hints, found);
}

namespace hapticd::client {
namespace {

using Clock = std::chrono::steady_clock;
using std::chrono::hours;
using std::chrono::milliseconds;

/// Keeps look-ups of names from returning while it exists.
struct NameServerGone {
  NameServerGone() { hangs = true; }
  ~NameServerGone() {
    hangs = false;
    hangs.notify_all();
  }
  NameServerGone(const NameServerGone&) = delete;
  NameServerGone& operator=(const NameServerGone&) = delete;
};

TEST(HostLookup, FindsNumbersAndNamesAndSaysWhatIsNone) {
  for (const char* host : {"127.0.0.1", "::1", "localhost"}) {
    EXPECT_TRUE(look_up(host, "50052", Clock::now() + hours(1), -1).first) << host;
  }
  const HostAddresses none = look_up(kUnknownName, "50052", Clock::now() + hours(1), -1);
  EXPECT_FALSE(none.first);
  EXPECT_EQ(none.problem, gai_strerror(EAI_AGAIN));
}

TEST(HostLookup, EndsInTimeAndWhenItIsCancelled) {
  const NameServerGone gone;
  const HostAddresses late = look_up("localhost", "50052", Clock::now() + milliseconds(20), -1);
  EXPECT_FALSE(late.first);
  EXPECT_EQ(late.problem, "");
  const int cancelled = eventfd(1, EFD_CLOEXEC);
  EXPECT_FALSE(look_up("localhost", "50052", Clock::now() + hours(1), cancelled).first);
  close(cancelled);
}

TEST(HostLookup, AStopIsGivenUpInTime) {
  const NameServerGone gone;
  const Error error =
      test::thrown_by<Error>([&] { stop_by_stop_port("localhost:50051", "", milliseconds(20)); });
  EXPECT_EQ(error.kind(), ErrorKind::kTimedOut) << error.what();
}

}  // namespace
}  // namespace hapticd::client
