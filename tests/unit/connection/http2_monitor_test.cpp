#include "server/connection/http2_monitor.h"

#include <gtest/gtest.h>

#include <string>

namespace hapticd::server {
namespace {

using namespace std::chrono_literals;

std::string frame(int type, int flags, unsigned stream, const std::string& payload) {
  std::string bytes;
  for (const unsigned shift : {16U, 8U, 0U}) bytes += static_cast<char>((payload.size() >> shift) & 0xFFU);
  bytes += static_cast<char>(type);
  bytes += static_cast<char>(flags);
  for (const unsigned shift : {24U, 16U, 8U, 0U}) bytes += static_cast<char>((stream >> shift) & 0xFFU);
  return bytes + payload;
}

const std::string kPreface = "PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n";
constexpr int kEndStream = 1;
constexpr int kEndHeaders = 4;

std::string open_call(unsigned stream, const std::string& header = "header") {
  return frame(1, kEndHeaders, stream, header);
}
std::string reset(unsigned stream) {
  return frame(3, 0, stream, std::string(4, '\0'));
}

class Watched {
 public:
  explicit Watched(const AccountLimits& limits = {}) : account(limits) { watch.emplace(account); }
  /// What is wrong with it.
  std::string_view send(const std::string& bytes) { return watch->from_client(bytes, onward, now); }

  Account account;
  std::optional<Http2Monitor> watch;
  std::string onward;
  Allowance::Time now{1h};
};

TEST(Http2Monitor, PassesOnWhatIsInOrderInPiecesOfAnySize) {
  const std::string all = kPreface + frame(4, 0, 0, "") + open_call(1) + frame(0, kEndStream, 1, "request") +
                          frame(1, 0, 3, "first") + frame(9, 0, 3, "more") +
                          frame(9, kEndHeaders, 3, "last") + frame(8, 0, 0, std::string(4, '\1'));
  for (const std::size_t size : {std::size_t{1}, std::size_t{7}, all.size()}) {
    Watched watched;
    for (std::size_t at = 0; at < all.size(); at += size) EXPECT_EQ(watched.send(all.substr(at, size)), "");
    EXPECT_EQ(watched.onward, all);
    EXPECT_TRUE(watched.watch->has_begun());
    EXPECT_EQ(watched.account.calls, 2);
    EXPECT_EQ(watched.account.unfinished_bytes, 7U) << "of the request";
    watched.watch.reset();
    EXPECT_EQ(watched.account.calls, 0) << "the connection is over";
    EXPECT_EQ(watched.account.unfinished_bytes, 0U);
  }
}

TEST(Http2Monitor, KeepsAHeaderBackUntilItIsComplete) {
  Watched watched;
  EXPECT_EQ(watched.send(kPreface + frame(1, 0, 1, "begin")), "");
  EXPECT_EQ(watched.onward, kPreface);
  EXPECT_EQ(watched.account.unfinished_bytes, 14U);
  EXPECT_EQ(watched.send(frame(9, kEndHeaders, 1, "end")), "");
  EXPECT_EQ(watched.onward, kPreface + frame(1, 0, 1, "begin") + frame(9, kEndHeaders, 1, "end"));
  EXPECT_EQ(watched.account.unfinished_bytes, 0U);
}

TEST(Http2Monitor, RefusesWhatNoClientSends) {
  const std::string much(16'000, 'x');
  for (const std::string& bytes :
       {std::string("GET / HTTP/1.1\r\n"), std::string("\x16\x03\x01"),
        kPreface + frame(1, 0, 1, much) + frame(9, 0, 1, much),
        kPreface + frame(1, 0, 1, "") + frame(0, 0, 1, ""), kPreface + frame(9, 0, 1, ""),
        kPreface + frame(5, 0, 1, ""), kPreface + frame(6, 0, 0, much + much)}) {
    Watched watched;
    EXPECT_NE(watched.send(bytes), "");
  }
}

TEST(Http2Monitor, CountsACallUntilTheServiceHasAnsweredIt) {
  Watched watched;
  ASSERT_EQ(watched.send(kPreface + open_call(1) + open_call(3) + open_call(5)), "");
  EXPECT_EQ(watched.account.calls, 3);
  const std::string answers = frame(1, kEndHeaders, 1, "headers") + frame(0, 0, 1, "answer") +
                              frame(1, kEndHeaders | kEndStream, 1, "trailers") + reset(3);
  for (const char byte : answers) watched.watch->from_service(std::string(1, byte));
  EXPECT_EQ(watched.account.calls, 1);
  EXPECT_EQ(watched.watch->calls_answered(), 2U);
  ASSERT_EQ(watched.send(reset(5)), "");
  EXPECT_EQ(watched.account.calls, 0);
}

TEST(Http2Monitor, LimitsWhatAllConnectionsOfAClientHaveUnderWay) {
  Account account({.max_calls = 3, .max_unfinished_bytes = 1000});
  Http2Monitor first(account);
  Http2Monitor second(account);
  std::string onward;
  const Allowance::Time now{1h};
  EXPECT_EQ(first.from_client(kPreface + open_call(1) + open_call(3), onward, now), "");
  EXPECT_EQ(second.from_client(kPreface + open_call(1), onward, now), "");
  EXPECT_EQ(second.from_client(open_call(3), onward, now), "it has too many calls under way");
  EXPECT_EQ(first.from_client(frame(0, 0, 1, std::string(900, 'x')), onward, now), "");
  EXPECT_EQ(first.from_client(frame(0, 0, 3, std::string(200, 'x')), onward, now),
            "its unfinished requests are too large");
}

TEST(Http2Monitor, LetsARecordingOfAnyLengthThrough) {
  Watched watched;
  ASSERT_EQ(watched.send(kPreface + open_call(1)), "");
  for (int i = 0; i < 10'000; ++i) {
    watched.onward.clear();
    ASSERT_EQ(watched.send(frame(0, 0, 1, std::string(16'000, 'x'))), "") << i;
  }
  EXPECT_LE(watched.account.unfinished_bytes, 1U << 20U);
}

/// A message of so many bytes, as gRPC puts it into frames.
std::string message(unsigned size) {
  std::string bytes(1, '\0');
  for (const unsigned shift : {24U, 16U, 8U, 0U}) bytes += static_cast<char>((size >> shift) & 0xFFU);
  return bytes + std::string(size, 'x');
}

// A request of 1 MB in pieces of 24 bytes, with other bytes in between, took as much memory as gRPC may have,
// by one connection; gRPC then ended calls of all clients.
TEST(Http2Monitor, LimitsThePiecesOfRequests) {
  Watched watched({.max_pieces = 1000});
  const std::string large = message(1'000'000);
  ASSERT_EQ(watched.send(kPreface + open_call(1) + open_call(3)), "");
  for (std::size_t i = 0; i < 990; ++i) ASSERT_EQ(watched.send(frame(0, 0, 1, large.substr(24 * i, 24))), "");
  EXPECT_EQ(watched.account.pieces, 990U);
  ASSERT_EQ(watched.send(reset(1)), "");
  EXPECT_EQ(watched.account.pieces, 0U);
  std::string_view problem;
  for (std::size_t i = 0; i <= 1000 && problem.empty(); ++i)
    problem = watched.send(frame(0, 0, 3, large.substr(24 * i, 24)));
  EXPECT_EQ(problem, "its requests come in too many pieces");
}

TEST(Http2Monitor, LetsAStreamOfSmallMessagesThrough) {
  AccountLimits limits{.max_pieces = 1000};
  std::string messages;
  for (int i = 0; i < 5000; ++i) messages += message(100);
  for (const std::size_t piece : {std::size_t{105}, std::size_t{70}, std::size_t{250}}) {
    Watched watched(limits);
    ASSERT_EQ(watched.send(kPreface + open_call(1)), "");
    for (std::size_t at = 0; at < messages.size(); at += piece)
      ASSERT_EQ(watched.send(frame(0, 0, 1, messages.substr(at, piece))), "") << at;
  }
}

TEST(Http2Monitor, ClosesWhoOpensCallsAndGivesThemUp) {
  Watched watched;
  ASSERT_EQ(watched.send(kPreface), "");
  unsigned stream = 1;
  const auto give_up = [&] {
    const std::string bytes = open_call(stream) + reset(stream);
    stream += 2;
    return watched.send(bytes);
  };
  for (int i = 0; i < 500; ++i) ASSERT_EQ(give_up(), "") << i;
  watched.now += 1s;
  for (int i = 0; i < 100; ++i) ASSERT_EQ(give_up(), "") << i;
  EXPECT_EQ(give_up(), "it opens calls and gives them up at once");
}

TEST(Http2Monitor, ClosesWhoSendsFramesWithoutACall) {
  for (const std::string& one :
       {frame(6, 0, 0, std::string(8, '\0')), frame(4, 0, 0, ""), frame(2, 0, 1, "12345"), frame(0, 0, 1, ""),
        frame(77, 0, 0, ""), frame(7, 0, 0, std::string(8, '\0')), frame(8, 0, 0, std::string(4, '\1'))}) {
    Watched watched;
    ASSERT_EQ(watched.send(kPreface), "");
    int sent = 0;
    while (sent < 10'000 && watched.send(one).empty()) ++sent;
    EXPECT_EQ(sent, 16 + 2000);
  }
}

TEST(Http2Monitor, LetsAClientWidenItsWindowsByWhatItWasSent) {
  Watched watched;
  ASSERT_EQ(watched.send(kPreface + open_call(1)), "");
  const std::string widen = frame(8, 0, 0, std::string(4, '\1')) + frame(8, 0, 1, std::string(4, '\1'));
  for (int i = 0; i < 100'000; ++i) {
    watched.watch->from_service(frame(0, 0, 1, "a record"));
    ASSERT_EQ(watched.send(widen), "") << i;
  }
}

TEST(Http2Monitor, KeepsAConnectionWhoseClientFloodsByAnother) {
  Watched flooding;
  ASSERT_EQ(flooding.send(kPreface), "");
  const std::string ping = frame(6, 0, 0, std::string(8, '\0'));
  while (flooding.send(ping).empty()) {
  }
  Http2Monitor honest(flooding.account);
  std::string onward;
  EXPECT_EQ(honest.from_client(kPreface + frame(4, 0, 0, "") + ping, onward, flooding.now), "");
}

}  // namespace
}  // namespace hapticd::server
