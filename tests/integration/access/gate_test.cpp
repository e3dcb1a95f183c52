// Who may do what, over the network.

#include <grpcpp/generic/generic_stub.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <fstream>
#include <iterator>
#include <sstream>
#include <string>
#include <vector>

#include "server/access/access_table.h"
#include "server/access/local_user.h"
#include "server/access/role_policy.h"
#include "tests/integration/access/access_client.h"
#include "tests/integration/error_detail.h"
#include "tests/support/temporary_folder.h"

namespace hapticd::test {
namespace {

using server::Role;

server::DaemonConfig config_with(Role role) {
  server::DaemonConfig config = quiet_config();
  config.access.local_role = role;
  return config;
}

/// The status of a call with an empty request, whatever kind of call it is.
grpc::Status call_empty(const std::shared_ptr<grpc::Channel>& channel, const std::string& method) {
  grpc::GenericStub stub(channel);
  const auto context = call_context();
  grpc::CompletionQueue queue;
  const auto stream = stub.PrepareCall(context.get(), "/hapticd.v1." + method, &queue);
  const auto done = [&queue] {
    void* tag = nullptr;
    bool ok = false;
    return queue.Next(&tag, &ok) && ok;
  };
  stream->StartCall(nullptr);
  done();
  const grpc::Slice nothing{std::string()};
  stream->WriteLast(grpc::ByteBuffer(&nothing, 1), grpc::WriteOptions(), nullptr);
  done();
  grpc::ByteBuffer answer;
  stream->Read(&answer, nullptr);
  if (done()) context->TryCancel();  // a stream would go on
  grpc::Status status;
  stream->Finish(&status, nullptr);
  done();
  return status;
}

TEST(Gate, RefusesEveryCallThatTheRoleDoesNotHaveAndNoOther) {
  for (const Role role : {Role::kNone, Role::kObserver, Role::kOperator}) {
    const RunningService service(config_with(role));
    for (const server::AccessRow& row : server::kAccessTable) {
      const grpc::Status status = call_empty(service.channel, std::string(row.method));
      const bool refused = status.error_code() == grpc::StatusCode::PERMISSION_DENIED;
      EXPECT_EQ(refused, role < row.role) << row.method << ": " << status.error_message();
      if (!refused) continue;
      const v1::ErrorDetail detail = detail_of(status);
      EXPECT_EQ(detail.reason(), v1::ERROR_REASON_NOT_PERMITTED);
      EXPECT_EQ(detail.where(), row.method);
      EXPECT_NE(
          detail.value().find(role == Role::kNone ? "without a role" : std::string(server::to_text(role))),
          std::string::npos)
          << detail.value();
      EXPECT_FALSE(detail.remedy().empty());
    }
  }
}

TEST(Gate, LetsAnObserverStopButNotClear) {
  const RunningService service(config_with(Role::kObserver));
  v1::StopResponse stopped;
  EXPECT_TRUE(service.safety->Stop(call_context().get(), {}, &stopped).ok());
  service.await([](const v1::RigState& state) { return state.guard_state() == v1::GUARD_STATE_LATCHED; });
  v1::ClearResponse cleared;
  EXPECT_EQ(service.safety->Clear(call_context().get(), {}, &cleared).error_code(),
            grpc::StatusCode::PERMISSION_DENIED);
}

TEST(Gate, SaysWhoTheCallerIs) {
  const RunningService service;
  const AccessClient client(connect(service.address()));
  v1::Access access;
  ASSERT_TRUE(client.access->GetAccess(call_context().get(), {}, &access).ok());
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
  v1::Access access;
  ASSERT_TRUE(client.access->GetAccess(call_context().get(), {}, &access).ok());
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
  v1::Access access;
  ASSERT_TRUE(client.access->GetAccess(call_context().get(), {}, &access).ok());
  EXPECT_EQ(access.identity(), "unix:" + group);
  EXPECT_EQ(access.role(), v1::ROLE_OBSERVER);
  EXPECT_EQ(client.load("tap_1d").error_code(), grpc::StatusCode::PERMISSION_DENIED);
}

TEST(Gate, LetsTheDeniedDoNothing) {
  server::DaemonConfig config = quiet_config();
  config.access.denied["user:" + server::user_of_id(getuid()).name] = "left the lab";
  config.access.denied["local"] = "left the lab";
  const RunningService service(config);
  v1::StopResponse stopped;
  const grpc::Status status = service.safety->Stop(call_context().get(), {}, &stopped);
  EXPECT_EQ(status.error_code(), grpc::StatusCode::UNAUTHENTICATED);
  EXPECT_EQ(detail_of(status).reason(), v1::ERROR_REASON_NOT_IDENTIFIED);
  EXPECT_EQ(detail_of(status).limit(), "left the lab");
}

std::string text_of_file(const std::string& path) {
  std::ifstream file(path);
  return {std::istreambuf_iterator<char>(file), {}};
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
    v1::StopResponse stopped;
    EXPECT_TRUE(service.safety->Stop(call_context().get(), stop, &stopped).ok());
    v1::ClearResponse cleared;
    EXPECT_TRUE(service.safety->Clear(call_context().get(), {}, &cleared).ok());
  }
  const std::string text = text_of_file(config.access.audit_file);
  std::vector<std::string> lines;
  std::istringstream stream(text);
  for (std::string line; std::getline(stream, line);) lines.push_back(line);
  ASSERT_EQ(lines.size(), 5U) << text;
  const auto expect_has = [&](std::size_t line, std::initializer_list<const char*> parts) {
    for (const char* part : parts)
      EXPECT_NE(lines[line].find(part), std::string::npos) << part << " in " << lines[line];
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
