#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <thread>

#include "tests/integration/command_record.h"

namespace hapticd::test {
namespace {

/// Sets one target again and again, without a ramp, some hundred times a second.
int insist(const std::string& address, double stiffness_n_per_mm, int times, std::atomic<int>& refused) {
  const ServiceClient client(connect(address));
  v1::SetTargetRequest request;
  request.set_stiffness_n_per_mm(stiffness_n_per_mm);
  request.set_ramp_s(0.0);
  int lengthened = 0;
  for (int i = 0; i < times; ++i) {
    v1::SetTargetResponse response;
    const grpc::Status status = client.set_target(request, &response);
    if (!status.ok() && refused++ == 0)
      ADD_FAILURE() << status.error_code() << ": " << status.error_message();
    if (response.ramp_s() >= 0.1 && response.explanation().find("was lengthened") != std::string::npos)
      ++lengthened;
    std::this_thread::sleep_for(std::chrono::milliseconds(9));
  }
  return lengthened;
}

void expect_no_jolt(const RunningService& service, double hand_force_n) {
  service.press(hand_force_n, [](const v1::RigState& s) { return s.displacement_mm() > 3.0; });
  CommandRecord record(service.channel);
  constexpr int kTimes = 300;
  std::atomic<int> refused{0};
  int soft = 0;
  int hard = 0;
  std::thread one([&] { soft = insist(service.address(), 0.3, kTimes, refused); });
  std::thread other([&] { hard = insist(service.address(), 1.2, kTimes, refused); });
  one.join();
  other.join();
  EXPECT_EQ(refused.load(), 0);
  EXPECT_EQ(soft, kTimes);
  EXPECT_EQ(hard, kTimes);
  const auto ticks = record.stop();
  EXPECT_GT(ticks.size(), 2000U);
  double min_n = 1e9;
  double max_n = -1e9;
  for (const auto& [tick, command] : ticks) {
    min_n = std::min(min_n, command.force_n.z);
    max_n = std::max(max_n, command.force_n.z);
  }
  EXPECT_GT(max_n - min_n, 0.2) << "the targets did change the force";
  const LargestStep largest = largest_step(ticks);
  testing::Test::RecordProperty("largest_step_n", std::to_string(largest.step_n));
  EXPECT_LE(largest.step_n, 0.3) << largest.around;
}

/// Configuration in virtual time: a machine that stalls moves the simulated object on under the tool, and
/// that too is a step.
server::DaemonConfig config_in_virtual_time() {
  server::DaemonConfig config = quiet_config();
  config.simulation.real_time = false;
  return config;
}

TEST(FightingClients, MakeNoStepsOfForceAlongOneAxis) {
  const RunningService service(config_in_virtual_time());
  ASSERT_TRUE(service.load("tap_1d").ok());
  expect_no_jolt(service, 2.0);
}

TEST(FightingClients, MakeNoStepsOfForceExploring) {
  server::DaemonConfig config = config_in_virtual_time();
  config.simulation.object = "foam_ball_3d";
  const RunningService service(config);
  ASSERT_TRUE(service.load("explore_rod").ok());
  expect_no_jolt(service, 3.0);
}

}  // namespace
}  // namespace hapticd::test
