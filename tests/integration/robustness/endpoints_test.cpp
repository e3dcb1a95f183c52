#include <gtest/gtest.h>

#include <filesystem>
#include <string>

#include "tests/integration/robustness/raw_call.h"
#include "tests/support/temporary_folder.h"

namespace hapticd::test {
namespace {

TEST(ServiceEndpoints, ReportTheirHealth) {
  const RunningService service;
  EXPECT_EQ(raw_call(service.channel, "/grpc.health.v1.Health/Check", "").bytes, std::string("\x08\x01", 2))
      << "field 1, status: SERVING";
}

TEST(ServiceEndpoints, DescribeThemselves) {
  const RunningService service;
  const std::string list =
      raw_call(service.channel, "/grpc.reflection.v1alpha.ServerReflection/ServerReflectionInfo",
               std::string("\x3a\x01*", 3))
          .bytes;  // field 7, list_services: "*"
  for (const char* name : {"RigService", "SceneService", "RenderingService", "TelemetryService",
                           "SimulationService", "SafetyService"}) {
    EXPECT_NE(list.find(std::string("hapticd.v1.") + name), std::string::npos) << name;
  }
}

TEST(ServiceEndpoints, RefuseAnOversizedMessage) {
  const RunningService service;
  const grpc::Status status = service.load_toml("# " + std::string(2 << 20, 'x'));
  EXPECT_EQ(status.error_code(), grpc::StatusCode::RESOURCE_EXHAUSTED) << status.error_message();
  EXPECT_NE(status.error_message().find("larger than max"), std::string::npos) << status.error_message();
  EXPECT_TRUE(service.load("tap_1d").ok()) << "and the service goes on";
}

TEST(ServiceEndpoints, ServeTheUnixSocketToo) {
  const TemporaryFolder folder;
  server::DaemonConfig config = quiet_config();
  config.unix_socket = folder.path("hapticd.sock");
  const RunningService service(config);
  const auto stub = v1::RigService::NewStub(connect("unix:" + config.unix_socket));
  const v1::RigInfo info = answer_of(*stub, &v1::RigService::Stub::GetRigInfo);
  EXPECT_EQ(info.name(), "sim:phantom_1_0");
  EXPECT_EQ(info.kind(), v1::RIG_KIND_SIMULATED);
  EXPECT_FALSE(info.server_version().empty());
  EXPECT_FALSE(info.uncertain_parameters().empty());
}

/// Expects that no daemon starts with this configuration, for `where` cannot be listened on.
void expect_cannot_listen(const server::DaemonConfig& config, const std::string& where) {
  server::StartFailure failure;
  EXPECT_EQ(server::Daemon::start(config, failure), nullptr);
  EXPECT_EQ(failure.code, server::ExitCode::kCannotListen);
  EXPECT_EQ(failure.error.where, where) << failure.error.text();
}

/// A configuration that serves a unix socket at a path as well.
server::DaemonConfig with_socket(const std::string& path) {
  server::DaemonConfig config = quiet_config();
  config.unix_socket = path;
  return config;
}

bool answers(const std::string& unix_socket) {
  v1::RigInfo info;
  const auto stub = v1::RigService::NewStub(connect("unix:" + unix_socket));
  return stub->GetRigInfo(call_context().get(), {}, &info).ok();
}

TEST(ServiceEndpoints, RefuseASecondDaemonWhoseLockFileWasDeletedUnderTheFirst) {
  const TemporaryFolder folder;
  const server::DaemonConfig config = with_socket(folder.path("hapticd.sock"));
  const RunningService service(config);
  ASSERT_TRUE(std::filesystem::remove(config.unix_socket + ".lock"));
  expect_cannot_listen(config, config.unix_socket);
  EXPECT_TRUE(answers(config.unix_socket)) << "the socket is still the first's";
}

TEST(ServiceEndpoints, RefuseAUnixSocketWhosePathIsTooLongOrTaken) {
  const TemporaryFolder folder;
  for (const std::string& path :
       {folder.path(std::string(200, 's')), folder.write("thesis.txt", "ten years of work")}) {
    expect_cannot_listen(with_socket(path), path);
  }
  EXPECT_TRUE(std::filesystem::exists(folder.path("thesis.txt"))) << "never removed";
}

}  // namespace
}  // namespace hapticd::test
