#include "client/cpp/address.h"

#include <gtest/gtest.h>

#include "client/cpp/error.h"
#include "tests/support/value_of.h"

namespace hapticd::client {
namespace {

TEST(Address, KnowsHostsAndUnixSockets) {
  EXPECT_EQ(channel_target("127.0.0.1:50051"), "dns:///127.0.0.1:50051");
  EXPECT_EQ(channel_target("lab-7:1"), "dns:///lab-7:1");
  EXPECT_EQ(channel_target("[::1]:65535"), "dns:///[::1]:65535");
  EXPECT_EQ(channel_target("unix:/run/hapticd.sock"), "unix:/run/hapticd.sock");
}

TEST(Address, RefusesWhatIsNotAnAddress) {
  for (const char* address : {"", "localhost", "localhost:", "localhost:0", "localhost:65536", "localhost:5o",
                              ":50051", "unix:", "::1:50051", "http://host:1"}) {
    const Error error = test::thrown_by<Error>([&] { channel_target(address); });
    EXPECT_EQ(error.kind(), ErrorKind::kBadAddress) << address;
    EXPECT_NE(error.detail().limit(), "") << address;
  }
}

}  // namespace
}  // namespace hapticd::client
