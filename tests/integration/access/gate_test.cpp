// Rights of the clients, over the network.

#include <gtest/gtest.h>
#include <unistd.h>

#include <sstream>
#include <string>
#include <vector>

#include "server/access/access_table.h"
#include "server/access/local_user.h"
#include "server/access/role_policy.h"
#include "tests/integration/access/access_client.h"
#include "tests/integration/error_detail.h"
#include "tests/integration/robustness/raw_call.h"
#include "tests/support/eventually.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/texts.h"

namespace hapticd::test {
namespace {

using server::Role;

server::DaemonConfig config_with(Role role) {
  server::DaemonConfig config = quiet_config();
  config.access.local_role = role;
  return config;
}

TEST(Gate, RefusesEveryCallThatTheRoleDoesNotHaveAndNoOther) {
  for (const Role role : {Role::kNone, Role::kObserver, Role::kOperator}) {
    const RunningService service(config_with(role));
    for (const server::AccessRow& row : server::kAccessTable) {
      const grpc::Status status =
          raw_call(service.channel, "/hapticd.v1." + std::string(row.method), "", false).status;
      const bool refused = status.error_code() == grpc::StatusCode::PERMISSION_DENIED;
      EXPECT_EQ(refused, role < row.role) << row.method << ": " << status.error_message();
      if (!refused) continue;
      const v1::ErrorDetail detail = detail_of(status);
      EXPECT_EQ(detail.reason(), v1::ERROR_REASON_NOT_PERMITTED);
      EXPECT_EQ(detail.where(), row.method);
      EXPECT_TRUE(
          holds(detail.value(), role == Role::kNone ? "without a role" : std::string(server::to_text(role))));
      EXPECT_FALSE(detail.remedy().empty());
    }
  }
}

TEST(Gate, OneIdentityHasSoManyCallsAndMayAlwaysStop) {
  server::DaemonConfig config = quiet_config();
  config.access.max_calls = 16;
  const RunningService service(config);
  std::vector<std::unique_ptr<grpc::ClientContext>> contexts;
  std::vector<std::unique_ptr<grpc::ClientReader<v1::TelemetryBatch>>> streams;
  v1::TelemetryBatch batch;
  for (int i = 0; i < 16; ++i) {
    contexts.push_back(call_context());
    streams.push_back(service.telemetry->Subscribe(contexts.back().get(), {}));
    ASSERT_TRUE(streams.back()->Read(&batch)) << i;
  }
  v1::RigState state;
  const grpc::Status refused = service.rig->GetRigState(call_context().get(), {}, &state);
  EXPECT_EQ(refused.error_code(), grpc::StatusCode::RESOURCE_EXHAUSTED);
  EXPECT_EQ(detail_of(refused).limit(), "access.max_calls = 16");
  EXPECT_TRUE(service.stop().ok());
  contexts.front()->TryCancel();
  streams.front()->Finish();
  EXPECT_TRUE(eventually([&] { return service.rig->GetRigState(call_context().get(), {}, &state).ok(); }));
}

TEST(Gate, SaysWhoTheCallerIs) {
  const RunningService service;
  const AccessClient client(connect(service.address()));
  const v1::Access access = answer_of(*client.access, &v1::AccessService::Stub::GetAccess);
  if (access.identity() != "local") {
    EXPECT_EQ(access.identity(), "user:" + server::user_of_id(getuid()).name);
  }
  EXPECT_EQ(access.role(), v1::ROLE_MAINTAINER);
  EXPECT_EQ(access.lease_rule(), v1::LEASE_RULE_WHEN_TAKEN);
  EXPECT_EQ(access.rules_size(), static_cast<int>(server::kAccessTable.size()));
}

TEST(Gate, TakesTheRoleOfTheUserWhoConnected) {
  server::DaemonConfig config = config_with(Role::kNone);
  config.access.users[server::user_of_id(getuid()).name] = Role::kOperator;
  const RunningService service(config);
  const AccessClient client(connect(service.address()));
  const v1::Access access = answer_of(*client.access, &v1::AccessService::Stub::GetAccess);
  if (access.identity() == "local") GTEST_SKIP() << "this kernel does not say who connects (no sock_diag)";
  EXPECT_EQ(access.role(), v1::ROLE_OPERATOR);
  EXPECT_EQ(access.role_source(), "[access.users]");
  EXPECT_TRUE(service.load("tap_1d").ok());
}

TEST(Gate, GivesTheUnixSocketTheRoleOfItsGroup) {
  const TemporaryFolder folder;
  server::DaemonConfig config = config_with(Role::kMaintainer);
  config.unix_socket = folder.path("hapticd.sock");
  const std::string group = server::group_name(getegid());
  config.access.groups[group] = Role::kObserver;
  const RunningService service(config);
  const AccessClient client(connect("unix:" + config.unix_socket));
  const v1::Access access = answer_of(*client.access, &v1::AccessService::Stub::GetAccess);
  EXPECT_EQ(access.identity(), "user:" + server::user_of_id(getuid()).name);
  EXPECT_EQ(access.role(), v1::ROLE_OBSERVER);
  EXPECT_EQ(client.load("tap_1d").error_code(), grpc::StatusCode::PERMISSION_DENIED);
}

TEST(Gate, LetsTheDeniedDoNothing) {
  server::DaemonConfig config = quiet_config();
  config.access.denied["user:" + server::user_of_id(getuid()).name] = "left the lab";
  config.access.denied["local"] = "left the lab";
  const RunningService service(config);
  const grpc::Status status = service.stop();
  expect_refused_for(status, grpc::StatusCode::UNAUTHENTICATED, v1::ERROR_REASON_NOT_IDENTIFIED);
  EXPECT_TRUE(holds(detail_of(status).what(), "left the lab"));
}

std::unique_ptr<grpc::ClientContext> on_behalf_of(const std::string& name) {
  auto context = call_context();
  context->AddMetadata("hapticd-on-behalf-of", name);
  context->AddMetadata("hapticd-browser", "127.0.0.1:1");
  return context;
}

TEST(Gate, LetsNoOrdinaryClientCallOnBehalfOfAnother) {
  const RunningService service(config_with(Role::kOperator));
  const AccessClient client(connect(service.address()));
  for (const char* name : {"user:otto", "local", "spiffe://lab/hapticd/maintainer/otto", "x"}) {
    v1::UnloadSceneResponse unloaded;
    const grpc::Status status = service.scene->UnloadScene(on_behalf_of(name).get(), {}, &unloaded);
    EXPECT_EQ(status.error_code(), grpc::StatusCode::PERMISSION_DENIED);
    EXPECT_TRUE(holds(detail_of(status).value(), name));
    // What every identity may do is the client's own.
    v1::Access access;
    EXPECT_TRUE(client.access->GetAccess(on_behalf_of(name).get(), {}, &access).ok());
    EXPECT_EQ(access.role(), v1::ROLE_OPERATOR);
  }
  v1::StopResponse stopped;
  EXPECT_TRUE(service.safety->Stop(on_behalf_of("user:otto").get(), {}, &stopped).ok());
}

// This test's own user is the daemon's.
TEST(Gate, TakesThePersonThatAConsoleNames) {
  const TemporaryFolder folder;
  server::DaemonConfig config = config_with(Role::kObserver);
  config.scene = "tap_1d";
  config.unix_socket = folder.path("hapticd.sock");
  config.access.users["anna"] = Role::kOperator;
  config.access.denied["user:eve"] = "left the lab";
  const RunningService service(config);
  const AccessClient console(connect("unix:" + config.unix_socket));
  const auto unload = [&](const char* name) {
    v1::UnloadSceneResponse unloaded;
    return console.scene->UnloadScene(on_behalf_of(name).get(), {}, &unloaded).error_code();
  };
  EXPECT_EQ(unload("user:anna"), grpc::StatusCode::OK);
  EXPECT_EQ(unload("user:ben"), grpc::StatusCode::PERMISSION_DENIED);
  EXPECT_EQ(unload("user:eve"), grpc::StatusCode::UNAUTHENTICATED);
  EXPECT_EQ(unload("spiffe://lab/hapticd/operator/otto"), grpc::StatusCode::FAILED_PRECONDITION)
      << "as with a certificate of his own, a lease is required";
  // Without a name it is who it is.
  const v1::Access access = answer_of(*console.access, &v1::AccessService::Stub::GetAccess);
  EXPECT_EQ(access.identity().rfind("user:", 0), 0U) << access.identity();
  EXPECT_EQ(access.role(), v1::ROLE_OBSERVER);
}

TEST(Gate, AKeyOfTheConsoleIsRedeemedByAConsoleOnce) {
  const TemporaryFolder folder;
  server::DaemonConfig config = quiet_config();
  config.unix_socket = folder.path("hapticd.sock");
  const RunningService service(config);
  const AccessClient client(connect(service.address()));
  const AccessClient console(connect("unix:" + config.unix_socket));
  v1::OpenConsoleResponse opened;
  EXPECT_EQ(client.access->OpenConsole(call_context().get(), {}, &opened).error_code(),
            grpc::StatusCode::FAILED_PRECONDITION)
      << "no console runs";
  v1::ReportConsoleRequest report;
  report.set_url("http://127.0.0.1:50080");
  v1::ReportConsoleResponse reported;
  EXPECT_EQ(client.access->ReportConsole(call_context().get(), report, &reported).error_code(),
            grpc::StatusCode::PERMISSION_DENIED);
  ASSERT_TRUE(console.access->ReportConsole(call_context().get(), report, &reported).ok());
  ASSERT_TRUE(client.access->OpenConsole(call_context().get(), {}, &opened).ok());
  const std::string before = report.url() + "/open?key=";
  ASSERT_EQ(opened.url().substr(0, before.size()), before);
  v1::RedeemConsoleKeyRequest redeem;
  redeem.set_key(opened.url().substr(before.size()));
  v1::RedeemConsoleKeyResponse redeemed;
  EXPECT_EQ(client.access->RedeemConsoleKey(call_context().get(), redeem, &redeemed).error_code(),
            grpc::StatusCode::PERMISSION_DENIED);
  EXPECT_TRUE(console.access->RedeemConsoleKey(call_context().get(), redeem, &redeemed).ok());
  EXPECT_EQ(redeemed.identity(), answer_of(*client.access, &v1::AccessService::Stub::GetAccess).identity());
  EXPECT_EQ(console.access->RedeemConsoleKey(call_context().get(), redeem, &redeemed).error_code(),
            grpc::StatusCode::NOT_FOUND);
}

TEST(Audit, HasOneLineForEachRefusedOrStateChangingCall) {
  const TemporaryFolder folder;
  server::DaemonConfig config = quiet_config();
  config.access.audit_file = folder.path("audit.jsonl");
  {
    const RunningService service(config);
    v1::SetTargetRequest request;
    request.set_stiffness_n_per_mm(0.25);
    EXPECT_FALSE(service.set_target(request).ok()) << "no scene";
    EXPECT_TRUE(service.load("tap_1d").ok());
    EXPECT_TRUE(service.set_target(request).ok());
    (void)service.state();
    v1::StopRequest stop;
    stop.set_reason("tool change");
    EXPECT_TRUE(service.stop(stop).ok());
    EXPECT_TRUE(service.clear().ok());
  }
  const std::string text = file_text(config.access.audit_file);
  std::vector<std::string> lines;
  std::istringstream stream(text);
  for (std::string line; std::getline(stream, line);) lines.push_back(line);
  ASSERT_EQ(lines.size(), 5U) << text;
  const auto expect_has = [&](std::size_t line, std::initializer_list<const char*> parts) {
    for (const char* part : parts) EXPECT_TRUE(holds(lines[line], part)) << part << " in " << lines[line];
  };
  expect_has(0, {"RenderingService/SetTarget", "FAILED_PRECONDITION", "no scene is loaded",
                 "stiffness_n_per_mm: 0.25"});
  expect_has(1, {"SceneService/LoadScene", "\"OK\"", "effective_tick", "name: \\\"tap_1d\\\""});
  expect_has(2, {"RenderingService/SetTarget", "\"OK\"", "effective_tick", "\"lease\":1",
                 "\"role\":\"maintainer\""});
  expect_has(3, {"SafetyService/Stop", "tool change", "effective_tick"});
  expect_has(4, {"SafetyService/Clear", "\"OK\"", "effective_tick"});
}

}  // namespace
}  // namespace hapticd::test
