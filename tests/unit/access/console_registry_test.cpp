#include "server/access/console_registry.h"

#include <gtest/gtest.h>

#include <chrono>
#include <string>

#include "server/access/named_identities.h"

namespace hapticd::server {
namespace {

using std::chrono::seconds;

class ConsoleRegistryTest : public testing::Test {
 protected:
  std::chrono::steady_clock::time_point now_{seconds(1000)};
  ConsoleRegistry registry_{[this] { return now_; }};
};

TEST_F(ConsoleRegistryTest, AKeyWorksOnce) {
  const std::string key = registry_.issue_key("user:anna");
  EXPECT_EQ(key.size(), 32U);
  EXPECT_NE(registry_.issue_key("user:anna"), key);
  EXPECT_EQ(registry_.redeem(key), "user:anna");
  EXPECT_EQ(registry_.redeem(key), std::nullopt);
  EXPECT_EQ(registry_.redeem(""), std::nullopt);
}

TEST_F(ConsoleRegistryTest, AKeyIsGoodForAMinute) {
  const std::string key = registry_.issue_key("user:anna");
  now_ += seconds(61);
  EXPECT_EQ(registry_.redeem(key), std::nullopt);
}

TEST_F(ConsoleRegistryTest, TooManyKeysAreRefused) {
  std::string last;
  for (int i = 0; i < 300; ++i) last = registry_.issue_key("user:" + std::to_string(i));
  EXPECT_EQ(last, "");
  now_ += seconds(61);
  EXPECT_NE(registry_.issue_key("user:anna"), "");
}

TEST_F(ConsoleRegistryTest, OneIdentityDoesNotUseUpTheKeysOfOthers) {
  const std::string of_ben = registry_.issue_key("user:ben");
  const std::string first = registry_.issue_key("user:anna");
  now_ += seconds(1);
  std::string last;
  for (int i = 0; i < 300; ++i) last = registry_.issue_key("user:anna");
  EXPECT_EQ(registry_.redeem(last), "user:anna");
  EXPECT_EQ(registry_.redeem(first), std::nullopt) << "a newer one took its place";
  EXPECT_EQ(registry_.redeem(of_ben), "user:ben");
  EXPECT_NE(registry_.issue_key("user:ben"), "");
}

TEST_F(ConsoleRegistryTest, AConsoleThatReportsNoMoreIsForgotten) {
  EXPECT_EQ(registry_.urls().plain, "");
  registry_.report({"http://127.0.0.1:50080", "https://rig:8443"});
  EXPECT_EQ(registry_.urls().plain, "http://127.0.0.1:50080");
  EXPECT_EQ(registry_.urls().tls, "https://rig:8443");
  now_ += seconds(4);
  EXPECT_EQ(registry_.urls().plain, "");
}

TEST(NamedIdentities, HaveTheRolesOfTheConfiguration) {
  AccessConfig config;
  config.local_role = Role::kObserver;
  config.users["anna"] = Role::kMaintainer;
  config.groups["haptics"] = Role::kOperator;
  config.denied["user:eve"] = "left";
  config.denied["serial:4F1C20"] = "a lost laptop";
  const RolePolicy policy(config);
  int looked_up = 0;
  NamedIdentities named(policy, [&looked_up](const std::string& name) {
    ++looked_up;
    return LocalUser{name, {"haptics"}};
  });
  EXPECT_EQ(named.find("user:anna", "").role, Role::kMaintainer);
  EXPECT_EQ(named.find("user:ben", "").role, Role::kOperator);
  EXPECT_EQ(named.find("user:ben", "").name, "user:ben");
  EXPECT_EQ(looked_up, 2) << "each user once";
  EXPECT_TRUE(named.find("user:eve", "").is_denied);
  EXPECT_EQ(named.find("local", "").role, Role::kObserver);
  EXPECT_EQ(named.find("unix:haptics", "").role, Role::kNone) << "no name of a user";
  const Identity otto = named.find("spiffe://lab/hapticd/operator/otto", "00");
  EXPECT_EQ(otto.role, Role::kOperator);
  EXPECT_TRUE(otto.is_remote());
  EXPECT_EQ(named.find("spiffe://lab/hapticd/operator/otto", "4F1C20").denied_why, "a lost laptop");
  EXPECT_FALSE(named.find("spiffe://lab/hapticd/console/page", "").is_console) << "a browser is a person";
  EXPECT_EQ(named.find("anything", "").role, Role::kNone);
}

TEST(NamedIdentities, AConsolesCertificateHasNoRoleOfItsOwn) {
  const RolePolicy policy{AccessConfig{}};
  const Identity console = policy.of_certificate("spiffe://lab/hapticd/console/page", "");
  EXPECT_TRUE(console.is_console);
  EXPECT_EQ(console.role, Role::kNone);
  EXPECT_FALSE(policy.of_certificate("spiffe://lab/hapticd/maintainer/otto", "").is_console);
}

}  // namespace
}  // namespace hapticd::server
