#include "server/access/role_policy.h"

#include <gtest/gtest.h>

namespace hapticd::server {
namespace {

TEST(CertificateName, HasLabRoleAndName) {
  const auto name = parse_certificate_name("spiffe://optics/hapticd/operator/anna");
  ASSERT_TRUE(name);
  EXPECT_EQ(name->lab, "optics");
  EXPECT_EQ(name->role, Role::kOperator);
  EXPECT_EQ(name->name, "anna");
}

TEST(CertificateName, IsRefusedWhereItIsNone) {
  for (const char* text :
       {"", "spiffe://", "spiffe://lab/hapticd/operator", "spiffe://lab/hapticd/operator/",
        "spiffe://lab/hapticd/none/a", "spiffe://lab/hapticd/Operator/a", "spiffe://lab/other/operator/a",
        "spiffe:///hapticd/operator/a", "spiffe://lab/hapticd/operator/a/b", "https://lab/hapticd/operator/a",
        "spiffe://lab/hapticd/root/a"}) {
    EXPECT_FALSE(parse_certificate_name(text)) << text;
  }
}

TEST(RolePolicy, GivesTheOnlyUserOfAMachineEverything) {
  const RolePolicy policy{AccessConfig{}};
  const Identity anna = policy.of_user({"anna", {"anna", "users"}});
  EXPECT_EQ(anna.name, "user:anna");
  EXPECT_EQ(anna.role, Role::kMaintainer);
  EXPECT_EQ(policy.lease_rule(anna), LeaseRule::kWhenTaken);
  EXPECT_EQ(policy.of_user({}).name, "local");
}

TEST(RolePolicy, TakesTheLineOfTheUserBeforeThoseOfItsGroups) {
  AccessConfig config;
  config.local_role = Role::kNone;
  config.users["anna"] = Role::kObserver;
  config.groups["students"] = Role::kObserver;
  config.groups["haptics"] = Role::kOperator;
  const RolePolicy policy(config);
  EXPECT_EQ(policy.of_user({"anna", {"haptics"}}).role, Role::kObserver);
  EXPECT_EQ(policy.of_user({"ben", {"haptics", "students"}}).role, Role::kOperator)
      << "the highest of its groups";
  EXPECT_EQ(policy.of_user({"ben", {"students", "haptics"}}).role, Role::kOperator) << "in any order";
  EXPECT_EQ(policy.of_user({"carl", {"others"}}).role, Role::kNone);
  EXPECT_EQ(policy.of_unix_user({"carl", {"others"}}, "haptics").role, Role::kOperator) << "who may open it";
  EXPECT_EQ(policy.of_unix_user({"anna", {}}, "haptics").role, Role::kObserver);
  EXPECT_EQ(policy.of_unix_user({"carl", {}}, "others").name, "user:carl");
}

TEST(RolePolicy, AGroupCanLowerTheRoleOfAllOthers) {
  AccessConfig config;
  config.groups["students"] = Role::kObserver;
  const RolePolicy policy(config);
  EXPECT_EQ(policy.of_user({"ben", {"students"}}).role, Role::kObserver);
}

TEST(RolePolicy, TakesTheRoleOfACertificateUnlessALineSaysOtherwise) {
  AccessConfig config;
  config.certificates["spiffe://lab/hapticd/operator/anna"] = Role::kMaintainer;
  const RolePolicy policy(config);
  EXPECT_EQ(policy.of_certificate("spiffe://lab/hapticd/operator/anna", "").role, Role::kMaintainer);
  const Identity ben = policy.of_certificate("spiffe://lab/hapticd/observer/ben", "");
  EXPECT_EQ(ben.role, Role::kObserver);
  EXPECT_EQ(policy.lease_rule(ben), LeaseRule::kRequired);
  EXPECT_EQ(policy.of_certificate("", "").role, Role::kNone) << "no name, no role";
}

TEST(RolePolicy, RefusesAnUnknownUserAsSoonAsAnyIsNamed) {
  EXPECT_FALSE(RolePolicy(AccessConfig{}).of_user({}).is_denied);
  AccessConfig users;
  users.users["anna"] = Role::kObserver;
  EXPECT_TRUE(RolePolicy(users).of_user({}).is_denied);
  AccessConfig groups;
  groups.groups["students"] = Role::kObserver;
  EXPECT_TRUE(RolePolicy(groups).of_unix_user({}, "haptics").is_denied);
  AccessConfig denied;
  denied.denied["user:ben"] = "left the lab";
  EXPECT_TRUE(RolePolicy(denied).of_user({}).is_denied);
  EXPECT_FALSE(RolePolicy(denied).of_user({"anna", {}}).is_denied);
}

TEST(RolePolicy, TakesRolesFromCertificatesOfItsLabOnly) {
  AccessConfig config;
  config.lab = "optics";
  config.certificates["spiffe://acoustics/hapticd/observer/guest"] = Role::kObserver;
  const RolePolicy policy(config);
  EXPECT_EQ(policy.of_certificate("spiffe://optics/hapticd/operator/anna", "").role, Role::kOperator);
  const Identity other = policy.of_certificate("spiffe://acoustics/hapticd/maintainer/otto", "");
  EXPECT_EQ(other.role, Role::kNone);
  EXPECT_EQ(other.role_source, "certificate of the lab acoustics, not of optics");
  EXPECT_EQ(policy.of_certificate("spiffe://acoustics/hapticd/observer/guest", "").role, Role::kObserver)
      << "named by itself";
}

TEST(RolePolicy, DeniesTheGroupOfTheUnixSocketThere) {
  AccessConfig config;
  config.denied["unix:haptics"] = "use certificates";
  const RolePolicy policy(config);
  EXPECT_TRUE(policy.of_unix_user({"anna", {}}, "haptics").is_denied);
  EXPECT_FALSE(policy.of_user({"anna", {"haptics"}}).is_denied);
}

TEST(RolePolicy, DeniesByNameAndBySerialNumber) {
  AccessConfig config;
  config.denied["user:ben"] = "left the lab";
  config.denied["serial:0A1B"] = "laptop lost";
  const RolePolicy policy(config);
  EXPECT_TRUE(policy.of_user({"ben", {}}).is_denied);
  EXPECT_FALSE(policy.of_user({"anna", {}}).is_denied);
  const Identity lost = policy.of_certificate("spiffe://lab/hapticd/operator/anna", "0A1B");
  EXPECT_TRUE(lost.is_denied);
  EXPECT_EQ(lost.denied_why, "laptop lost");
  EXPECT_FALSE(policy.of_certificate("spiffe://lab/hapticd/operator/anna", "0A1C").is_denied);
}

}  // namespace
}  // namespace hapticd::server
