#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <regex>
#include <string>
#include <vector>

#include "tests/integration/running_service.h"
#include "tests/support/child_process.h"
#include "tests/support/lab.h"
#include "tests/support/temporary_folder.h"

namespace hapticd::test {
namespace {

std::string text_of(const std::string& path) {
  return file_text(std::string(SOURCE_FOLDER "/") + path);
}

TEST(Tutorials, TheFirstSceneLoadsAndIsSofterOutsideThanInside) {
  const RunningService service;
  v1::SetObjectRequest object;
  object.set_name("foam_ball_3d");
  answer_of(*service.simulation, &v1::SimulationService::Stub::SetObject, object);
  ASSERT_TRUE(ok(service.load_toml(text_of("tests/integration/tutorial/soft_with_core.toml"))));
  const auto target_above = [](double n_per_mm) {
    return [n_per_mm](const v1::RigState& s) {
      return s.in_contact() && s.target_stiffness_n_per_mm() > n_per_mm;
    };
  };
  EXPECT_NEAR(service.press(0.8, target_above(0.25)).target_stiffness_n_per_mm(), 0.3, 0.01);
  EXPECT_GT(service.press(4.0, target_above(0.4)).target_stiffness_n_per_mm(), 0.4);
}

/// A daemon that is reached plainly and with certificates; its own clients have them.
class ReachedBothWays {
 public:
  ReachedBothWays() : service_(config_with_certificates(lab_.server())) {
    setenv("HAPTICD_CERTIFICATES", lab_.client("anna").c_str(), 1);
  }
  ~ReachedBothWays() { unsetenv("HAPTICD_CERTIFICATES"); }
  ReachedBothWays(const ReachedBothWays&) = delete;
  ReachedBothWays& operator=(const ReachedBothWays&) = delete;
  /// Addresses; from elsewhere, commands need a lease, and a connection with certificates counts as such.
  std::vector<std::string> addresses() const {
    return {service_.address(), "tls:127.0.0.1:" + std::to_string(service_.daemon->tls_port())};
  }

 private:
  const Lab lab_;
  const RunningService service_;
};

TEST(Tutorials, TheFirstClientFeelsBothTargets) {
  const ReachedBothWays service;
  for (const std::string& address : service.addresses()) {
    ChildProcess client(FIRST_CLIENT, {address});
    ASSERT_EQ(client.wait(), 0) << address << client.output() << client.errors();
    std::smatch found;
    const std::regex lines(R"(granted 0\.30 N/mm, felt (\S+) N/mm\ngranted 0\.70 N/mm, felt (\S+) N/mm\n)");
    const std::string output = client.output();
    ASSERT_TRUE(std::regex_match(output, found, lines)) << output;
    EXPECT_NEAR(std::stod(found[1]), 0.3, 0.05);
    EXPECT_NEAR(std::stod(found[2]), 0.7, 0.1);
  }
}

TEST(Tutorials, TheFirstClientPrintsOneLineWhereNothingListens) {
  ChildProcess client(FIRST_CLIENT, {"127.0.0.1:1"});
  EXPECT_EQ(client.wait(), 1);
  EXPECT_NE(client.errors().find("127.0.0.1:1"), std::string::npos) << client.errors();
}

TEST(Tutorials, TheClientInPythonWorksWithWhatDebianHas) {
  ChildProcess import("/usr/bin/python3", {"-c", "import grpc, google.protobuf"});
  if (import.wait() != 0) {
    GTEST_SKIP() << "no gRPC for Python here: bash deploy/install_packages.sh docs";
  }
  const ReachedBothWays service;
  const TemporaryFolder folder;
  std::filesystem::current_path(folder.path());
  // The lines of the tutorial.
  ChildProcess generator("/bin/bash",
                         {"-c", "protoc -I " SOURCE_FOLDER "/proto --python_out=. --grpc_out=. "
                                "--plugin=protoc-gen-grpc=/usr/bin/grpc_python_plugin " SOURCE_FOLDER
                                "/proto/hapticd/v1/*.proto"});
  ASSERT_EQ(generator.wait(), 0) << generator.errors();
  for (const std::string& address : service.addresses()) {
    ChildProcess client("/bin/bash", {"-c", "PYTHONPATH=. /usr/bin/python3 " SOURCE_FOLDER
                                            "/client/python/examples/first_client.py " +
                                                address});
    ASSERT_EQ(client.wait(), 0) << address << client.errors();
    EXPECT_NE(client.output().find("granted 0.30 N/mm"), std::string::npos) << client.output();
    EXPECT_NE(client.output().find(" N at "), std::string::npos) << client.output();
  }
}

}  // namespace
}  // namespace hapticd::test
