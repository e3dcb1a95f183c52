// A stop stops, whatever its request is made of.

#include <gtest/gtest.h>

#include "server/grpc/calls/stop_request.h"
#include "tests/integration/command_record.h"
#include "tests/integration/robustness/raw_call.h"
#include "tests/support/http2_flood.h"

namespace hapticd::test {
namespace {

constexpr const char* kStop = "/hapticd.v1.SafetyService/Stop";

std::string with_reason(const std::string& reason) {
  std::string length;
  for (std::size_t left = reason.size();;) {
    const bool more = left >= 0x80;
    length += static_cast<char>((left & 0x7FU) | (more ? 0x80U : 0U));
    if (!more) break;
    left >>= 7U;
  }
  return "\x0a" + length + reason;
}

TEST(StopRequest, IsReadAsFarAsItCanBe) {
  using server::read_stop_request;
  EXPECT_EQ(read_stop_request("").text, "");
  EXPECT_TRUE(read_stop_request("").repairs.empty());
  EXPECT_EQ(read_stop_request(with_reason("enough")).text, "enough");
  EXPECT_TRUE(read_stop_request(with_reason("enough")).repairs.empty());
  EXPECT_EQ(read_stop_request(with_reason("two\nlines\x7f")).text, "two lines ");

  const auto latin1 =
      read_stop_request(with_reason("\xdc"
                                    "bersteuert"));
  EXPECT_EQ(latin1.text,
            "\xef\xbf\xbd"
            "bersteuert");
  ASSERT_EQ(latin1.repairs.size(), 1U);
  EXPECT_EQ(latin1.repairs[0], "the reason is not UTF-8: U+FFFD stands for what is not");

  const auto cut = read_stop_request(std::string_view("\x0a\x20half", 6));
  EXPECT_EQ(cut.text, "half");
  ASSERT_EQ(cut.repairs.size(), 1U);
  EXPECT_EQ(cut.repairs[0],
            "the request of 6 bytes is no whole StopRequest: what could be read of it was taken");

  const auto much = read_stop_request(with_reason(std::string(100000, 'x')));
  EXPECT_EQ(much.text.size(), 256U);
  ASSERT_EQ(much.repairs.size(), 1U);
  EXPECT_EQ(much.repairs[0], "the reason of 100000 bytes was cut to 256");

  // Fields of a later version are passed over.
  EXPECT_EQ(read_stop_request("\x10\x05" + with_reason("later") + "\x1a\x01z").text, "later");
  EXPECT_TRUE(read_stop_request("\x10\x05" + with_reason("later")).repairs.empty());
  for (const std::string& bytes :
       {std::string("\xff\xff\xff\xff\xff\xff\xff\xff\xff\xff\xff"), std::string("\x0b"),
        std::string("\x0a\xff\xff\xff\xff\xff\xff\xff\xff\x7f"), std::string("\x09\x01"),
        std::string(1, '\0')}) {
    EXPECT_LE(read_stop_request(bytes).repairs.size(), 1U);
  }
}

TEST(ServiceStop, StopsWhateverItsRequestHolds) {
  const RunningService service;
  ASSERT_TRUE(service.load("tap_1d").ok());
  CommandRecord record(service.channel);
  service.press(2.0, [](const v1::RigState& s) { return s.displacement_mm() > 2.0; });
  struct Request {
    const char* name;
    std::string bytes;
    int repairs;
  };
  const Request requests[] = {
      {"empty", "", 0},
      {"a reason", with_reason("enough"), 0},
      {"Latin-1",
       std::string("\x0a\x04\xfc"
                   "ber"),
       1},
      {"cut short",
       std::string("\x0a\x40"
                   "abc"),
       1},
      {"cut within a character", with_reason("caf\xc3"), 1},
      {"no message", std::string("\xff\xff\xff\xff\xff\xff"), 1},
      {"another field's type", std::string("\x08\x01"), 0},
      {"a text", "stop!", 1},
      {"900 kB of one letter", with_reason(std::string(900000, 'x')), 1},
      {"900 kB of no character", with_reason(std::string(900000, '\xfc')), 2},
  };
  std::uint64_t resumed_at = 0;
  std::vector<std::pair<std::uint64_t, std::uint64_t>> latched;  // first tick, the one it was promised by
  for (const Request& request : requests) {
    const RawAnswer answer = raw_call(service.channel, kStop, request.bytes);
    ASSERT_TRUE(answer.status.ok()) << request.name << ": " << answer.status.error_message();
    v1::StopResponse stopped;
    ASSERT_TRUE(stopped.ParseFromString(answer.bytes)) << request.name;
    EXPECT_EQ(stopped.guard_state(), v1::GUARD_STATE_LATCHED) << request.name;
    EXPECT_EQ(stopped.repairs_size(), request.repairs) << request.name << "\n" << stopped.DebugString();
    const std::uint64_t first = record.await_latched(resumed_at);
    EXPECT_LE(first, stopped.latched_after_tick() + 2) << request.name;
    const std::uint64_t held = latched.empty() ? 200 : 20;  // ticks
    latched.emplace_back(first, first + held);
    record.await_tick(first + held);
    v1::ClearResponse cleared;
    ASSERT_TRUE(service.safety->Clear(call_context().get(), {}, &cleared).ok()) << request.name;
    resumed_at = cleared.effective_tick();
    record.await_tick(resumed_at + 300);  // force is on its way back
  }
  const auto ticks = record.stop();
  for (const auto& [from, to] : latched) {
    for (auto tick = ticks.lower_bound(from); tick != ticks.end() && tick->first <= to; ++tick) {
      EXPECT_EQ(dot(tick->second.force_n, tick->second.force_n), 0.0) << "tick " << tick->first;
      EXPECT_EQ(tick->second.state, v1::GUARD_STATE_LATCHED) << "once latched it stays so";
    }
  }
  // So that zero means something: there was force before the first. After it the hand presses on, and what
  // was cut in contact comes back only once the tool was free.
  double max_n = 0.0;
  for (const auto& [tick, command] : ticks) max_n = std::max(max_n, std::abs(command.force_n.z));
  EXPECT_GT(max_n, 0.1);
}

// It cannot be answered, but its headers are enough.
TEST(ServiceStop, OneLargerThanAMebibyteStopsAndIsRefusedByTheTransport) {
  const RunningService service;
  const RawAnswer answer = raw_call(service.channel, kStop, with_reason(std::string(2 << 20, 'x')));
  EXPECT_EQ(answer.status.error_code(), grpc::StatusCode::RESOURCE_EXHAUSTED);
  const v1::RigState state = service.await(is_latched);
  EXPECT_EQ(state.guard_fault(), v1::GUARD_FAULT_STOPPED);
}

TEST(ServiceStop, OneWhoseRequestNeverComesStops) {
  const RunningService service;
  Http2Flood client(service.address());
  ASSERT_EQ(client.open_unfinished(kStop, 1, 10), 1);
  service.await(is_latched);
  EXPECT_FALSE(client.is_closed()) << "it is still being waited for";
}

}  // namespace
}  // namespace hapticd::test
