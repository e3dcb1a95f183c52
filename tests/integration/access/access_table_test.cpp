#include "server/access/access_table.h"

#include <google/protobuf/descriptor.pb.h>
#include <gtest/gtest.h>

#include <fstream>
#include <set>
#include <string>

#include "server/access/role_policy.h"
#include "tests/support/temporary_folder.h"

namespace hapticd::server {
namespace {

/// "RigService/GetRigInfo" of every call in the contract as it was compiled: a new .proto file counts too.
std::set<std::string> methods_of_contract() {
  google::protobuf::FileDescriptorSet files;
  std::ifstream compiled(CONTRACT_DESCRIPTORS, std::ios::binary);
  EXPECT_TRUE(files.ParseFromIstream(&compiled));
  std::set<std::string> methods;
  for (const auto& file : files.file()) {
    for (const auto& service : file.service()) {
      for (const auto& method : service.method()) methods.insert(service.name() + "/" + method.name());
    }
  }
  return methods;
}

TEST(AccessTable, HasARowForEveryCallOfTheContractAndNoOther) {
  const std::set<std::string> contract = methods_of_contract();
  EXPECT_GT(contract.size(), 40U);
  std::set<std::string> rows;
  for (const AccessRow& row : kAccessTable) {
    EXPECT_TRUE(rows.insert(std::string(row.method)).second) << row.method << " stands there twice";
    EXPECT_TRUE(contract.contains(std::string(row.method))) << row.method << " is no call of the contract";
  }
  for (const std::string& method : contract) {
    EXPECT_TRUE(rows.contains(method)) << method << " has no row in server/access/access_table.h";
  }
}

TEST(AccessTable, LetsAllWhoAreIdentifiedStop) {
  for (const char* method : {"SafetyService/Stop", "TurntableService/StopTurntable"}) {
    const AccessRow* row = find_access_row(method);
    ASSERT_NE(row, nullptr);
    EXPECT_EQ(row->role, Role::kNone);
    EXPECT_FALSE(row->needs_lease);
  }
  EXPECT_EQ(find_access_row("SafetyService/Clear")->role, Role::kOperator);
}

TEST(AccessTable, AuditsAllThatNeedsALease) {
  for (const AccessRow& row : kAccessTable) {
    if (row.needs_lease) {
      EXPECT_TRUE(row.is_audited) << row.method;
      EXPECT_GE(row.role, Role::kOperator) << row.method;
    }
  }
}

/// The table as docs/access.md prints it.
std::string access_table_markdown() {
  std::string text = "| call | role | lease | audit |\n|---|---|---|---|\n";
  for (const AccessRow& row : kAccessTable) {
    const std::string role = row.role == Role::kNone ? "any identity" : std::string(to_text(row.role));
    text += "| `" + std::string(row.method) + "` | " + role + " | " + (row.needs_lease ? "yes" : "no") +
            " | " + (row.is_audited ? "always" : "where refused") + " |\n";
  }
  return text;
}

TEST(AccessTable, StandsInTheDocumentation) {
  const std::string page = test::file_text(SOURCE_FOLDER "/docs/access.md");
  EXPECT_NE(page.find(access_table_markdown()), std::string::npos) << access_table_markdown();
}

}  // namespace
}  // namespace hapticd::server
