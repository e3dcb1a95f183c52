#include "server/process/memory_watch.h"

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <cstring>
#include <thread>
#include <vector>

namespace hapticd::server {
namespace {

class Socket {
 public:
  explicit Socket(int descriptor) : descriptor_(descriptor) {}
  ~Socket() { close(descriptor_); }
  Socket(const Socket&) = delete;
  Socket& operator=(const Socket&) = delete;
  int get() const { return descriptor_; }
  /// False where the other end is gone.
  bool is_open() const {
    char byte = 0;
    const ssize_t n = recv(descriptor_, &byte, 1, MSG_DONTWAIT);
    return n > 0 || (n < 0 && (errno == EAGAIN || errno == EWOULDBLOCK));
  }

 private:
  int descriptor_;
};

/// A service in this process, as far as the watch can see, that reads nothing.
class Listener {
 public:
  Listener() : socket_(socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
    address_.sin_family = AF_INET;
    address_.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    socklen_t length = sizeof address_;
    EXPECT_EQ(bind(socket_.get(), reinterpret_cast<sockaddr*>(&address_), length), 0);
    EXPECT_EQ(listen(socket_.get(), 8), 0);
    EXPECT_EQ(getsockname(socket_.get(), reinterpret_cast<sockaddr*>(&address_), &length), 0);
  }
  std::uint16_t port() const { return ntohs(address_.sin_port); }
  std::pair<int, int> connection() {
    const int client = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
    EXPECT_EQ(connect(client, reinterpret_cast<const sockaddr*>(&address_), sizeof address_), 0);
    return {client, accept(socket_.get(), nullptr, nullptr)};
  }

 private:
  Socket socket_;
  sockaddr_in address_{};
};

constexpr std::size_t kLimit = std::size_t{16} << 20U;

TEST(MemoryWatch, ClosesTheConnectionThatFloodsAndNoOtherWhereMemoryGrows) {
  Listener listener;
  const auto [quiet_client, quiet_service] = listener.connection();
  const auto [flooding_client, flooding_service] = listener.connection();
  const Socket quiet(quiet_client), quiet_end(quiet_service), flooding(flooding_client),
      flooding_end(flooding_service);
  const std::vector<char> much(100'000, 'x');
  std::vector<char> rubbish(much.size());
  ASSERT_EQ(send(quiet.get(), much.data(), much.size(), MSG_NOSIGNAL), 100'000) << "long ago";

  const MemoryWatch watch(listener.port(), kLimit);
  const auto flood_for = [&](std::chrono::milliseconds time) {
    const auto until = std::chrono::steady_clock::now() + time;
    while (std::chrono::steady_clock::now() < until && flooding.is_open()) {
      send(flooding.get(), much.data(), much.size(), MSG_NOSIGNAL | MSG_DONTWAIT);
      recv(flooding_end.get(), rubbish.data(), rubbish.size(), MSG_DONTWAIT);  // as a service does
      std::this_thread::sleep_for(std::chrono::milliseconds(2));
    }
  };
  flood_for(std::chrono::milliseconds(300));
  EXPECT_TRUE(flooding.is_open()) << "much is no harm as long as memory does not grow";

  std::vector<char> grown(3 * kLimit);
  std::memset(grown.data(), 1, grown.size());
  flood_for(std::chrono::seconds(60));  // ends when it is closed
  EXPECT_FALSE(flooding.is_open());
  EXPECT_TRUE(quiet.is_open());
  EXPECT_EQ(grown[kLimit], 1);
}

}  // namespace
}  // namespace hapticd::server
