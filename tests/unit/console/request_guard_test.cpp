#include "client/console/access/request_guard.h"

#include <gtest/gtest.h>

namespace hapticd::console {
namespace {

const RequestGuard kGuard({"rig.lab.example", "fd00::20"}, false);

RequestOrigin of_host(std::string_view host) {
  RequestOrigin from{};
  from.host = host;
  return from;
}

RequestOrigin good_post() {
  return {"127.0.0.1:50080", "http://127.0.0.1:50080", "same-origin", "application/json", "1"};
}

TEST(RequestGuard, KnowsItsOwnNames) {
  for (const char* host : {"127.0.0.1", "127.0.0.1:50080", "localhost:9000", "LocalHost", "[::1]:50080",
                           "rig.lab.example", "RIG.lab.example:8443", "[fd00::20]:1"}) {
    EXPECT_FALSE(kGuard.check(of_host(host))) << host;
  }
}

TEST(RequestGuard, RefusesNamesThatWereMadeToPointHere) {
  for (const char* host :
       {"", "evil.example", "evil.example:50080", "127.0.0.1.evil.example", "localhost.evil.example",
        "evil-localhost", "127.0.0.1:", "127.0.0.1:x", "127.0.0.1:123456", "localhost@evil.example",
        "127.0.0.1 evil", "0.0.0.0", "rig.lab.example."}) {
    const auto refusal = kGuard.check(of_host(host));
    ASSERT_TRUE(refusal) << host;
    EXPECT_EQ(refusal->http_status, 421U);
  }
  // Its own page is of the same origin as its request: the name alone shows it.
  RequestOrigin rebound = good_post();
  rebound.host = "evil.example:50080";
  rebound.origin = "http://evil.example:50080";
  EXPECT_TRUE(kGuard.check(rebound));
}

TEST(RequestGuard, RefusesOtherOrigins) {
  for (const char* origin :
       {"http://evil.example", "null", "https://127.0.0.1:50080", "http://127.0.0.1:50081",
        "http://127.0.0.1", "http://localhost:50080", "http://127.0.0.1:50080.evil.example"}) {
    RequestOrigin from = good_post();
    from.origin = origin;
    EXPECT_TRUE(kGuard.check(from)) << origin;
  }
  EXPECT_FALSE(kGuard.check(good_post()));
}

TEST(RequestGuard, TakesNoFormOfAnotherSite) {
  EXPECT_FALSE(kGuard.check_post(good_post()));
  for (const char* type : {"", "text/plain", "application/x-www-form-urlencoded", "multipart/form-data"}) {
    RequestOrigin from = good_post();
    from.content_type = type;
    EXPECT_EQ(kGuard.check_post(from)->http_status, 415U) << type;
  }
  RequestOrigin with_charset = good_post();
  with_charset.content_type = "application/json; charset=utf-8";
  EXPECT_FALSE(kGuard.check_post(with_charset));
  RequestOrigin without_header = good_post();
  without_header.console_header = "";
  EXPECT_TRUE(kGuard.check_post(without_header));
  RequestOrigin cross_site = good_post();
  cross_site.fetch_site = "cross-site";
  EXPECT_TRUE(kGuard.check_post(cross_site));
  RequestOrigin same_site = good_post();  // another port of this machine
  same_site.fetch_site = "same-site";
  EXPECT_TRUE(kGuard.check_post(same_site));
}

TEST(RequestGuard, OpensNoSocketWithoutAnOrigin) {
  RequestOrigin from = good_post();
  from.fetch_site = "";
  EXPECT_FALSE(kGuard.check_socket(from));
  from.origin = "";
  EXPECT_TRUE(kGuard.check_socket(from));
}

TEST(RequestGuard, ExpectsHttpsWhereItIsServed) {
  const RequestGuard guard({}, true);
  RequestOrigin from = good_post();
  EXPECT_TRUE(guard.check(from));
  from.origin = "https://127.0.0.1:50080";
  EXPECT_FALSE(guard.check(from));
}

TEST(Cookies, AreFoundByTheirWholeName) {
  EXPECT_EQ(cookie_value("a=1; hapticd_1=xyz; b=2", "hapticd_1"), "xyz");
  EXPECT_EQ(cookie_value("xhapticd_1=no; hapticd_10=no", "hapticd_1"), "");
  EXPECT_EQ(cookie_value("", "hapticd_1"), "");
  EXPECT_EQ(cookie_value("hapticd_1", "hapticd_1"), "");
}

}  // namespace
}  // namespace hapticd::console
