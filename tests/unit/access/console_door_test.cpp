#include "server/access/console_door.h"

#include <gtest/gtest.h>
#include <sys/stat.h>

#include <chrono>
#include <filesystem>
#include <fstream>

#include "tests/support/temporary_folder.h"

namespace hapticd::server {
namespace {

using std::chrono::seconds;

class ConsoleDoorTest : public testing::Test {
 protected:
  ConsoleDoor::Clock clock() {
    return [this] { return now_; };
  }
  Identity root() { return policy_.of_user({"root", {"root"}}); }

  std::chrono::system_clock::time_point now_{seconds(1'000'000)};
  RolePolicy policy_{AccessConfig{}};
  ConsoleDoor door_{policy_, "", seconds(3600), clock()};
};

TEST_F(ConsoleDoorTest, AKeyWorksOnce) {
  const std::string key = door_.issue_key(root());
  const auto cookie = door_.redeem(key);
  ASSERT_TRUE(cookie);
  EXPECT_FALSE(door_.redeem(key));
  const auto session = door_.session_of(*cookie);
  ASSERT_NE(session, nullptr);
  EXPECT_EQ(session->who.name, "user:root");
  EXPECT_EQ(session->who.role, Role::kMaintainer);
  EXPECT_EQ(door_.holder_of(session->pass)->name, "user:root");
}

TEST_F(ConsoleDoorTest, AKeyIsGoodForAMinute) {
  const std::string key = door_.issue_key(root());
  now_ += seconds(61);
  EXPECT_FALSE(door_.redeem(key));
}

TEST_F(ConsoleDoorTest, ACookieEnds) {
  const auto cookie = door_.redeem(door_.issue_key(root()));
  now_ += seconds(3599);
  EXPECT_NE(door_.session_of(*cookie), nullptr);
  now_ += seconds(2);
  EXPECT_EQ(door_.session_of(*cookie), nullptr);
}

TEST_F(ConsoleDoorTest, AChangedCookieIsNone) {
  const std::string cookie = *door_.redeem(door_.issue_key(root()));
  for (std::size_t i = 0; i < cookie.size(); ++i) {
    std::string changed = cookie;
    changed[i] = changed[i] == '0' ? '1' : '0';
    EXPECT_EQ(door_.session_of(changed), nullptr) << i;
  }
  for (const std::string& text : {std::string(), std::string("."), std::string("a.b"), cookie + "0",
                                  cookie.substr(1), std::string(5000, '0')}) {
    EXPECT_EQ(door_.session_of(text), nullptr) << text;
  }
}

TEST_F(ConsoleDoorTest, ThePassIsNotTheCookie) {
  const std::string cookie = *door_.redeem(door_.issue_key(root()));
  EXPECT_FALSE(door_.holder_of(cookie));
  EXPECT_FALSE(door_.holder_of(""));
}

TEST_F(ConsoleDoorTest, RolesAreThoseOfTheConfigurationNow) {
  const test::TemporaryFolder folder;
  const std::string path = folder.path("console.key");
  ConsoleDoor before(policy_, folder.path(), seconds(3600), clock());
  const std::string cookie = *before.redeem(before.issue_key(root()));
  struct stat file {};
  ASSERT_EQ(stat(path.c_str(), &file), 0);
  EXPECT_EQ(file.st_mode & 0777U, 0600U);
  AccessConfig stricter;
  stricter.users["root"] = Role::kObserver;
  stricter.denied["user:anna"] = "left";
  const RolePolicy policy(stricter);
  ConsoleDoor after(policy, folder.path(), seconds(3600), clock());
  const auto session = after.session_of(cookie);
  ASSERT_NE(session, nullptr);
  EXPECT_EQ(session->who.role, Role::kObserver);
  const auto denied = after.session_of(*after.redeem(after.issue_key(policy.of_user({"anna", {}}))));
  EXPECT_TRUE(denied->who.is_denied);
  // Another secret, another door.
  std::filesystem::remove(path);
  ConsoleDoor other(policy_, folder.path(), seconds(3600), clock());
  EXPECT_EQ(other.session_of(cookie), nullptr);
}

TEST_F(ConsoleDoorTest, TooManyKeysAreRefused) {
  std::string last;
  for (int i = 0; i < 300; ++i) last = door_.issue_key(root());
  EXPECT_EQ(last, "");
  now_ += seconds(61);
  EXPECT_NE(door_.issue_key(root()), "");
}

}  // namespace
}  // namespace hapticd::server
