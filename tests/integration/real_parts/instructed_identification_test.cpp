// Identifications by the commands a user types, live over the vendor's library and the Net F/T
// box: the emulated person knows the words of the daemon and does what they ask for.

#include <cmath>

#include "hapticd/v1/identification.grpc.pb.h"
#include "tests/integration/real_parts/emulated_rig_process.h"
#include "tests/support/system/priority_while_starting.h"

namespace hapticd::test {
namespace {

class InstructedIdentification : public EmulatedRigProcess {
 protected:
  /// What `hapticctl identify COMMAND` comes to on a rig with `world`; the person reads along.
  v1::IdentificationProgress identified(const Arguments& world, const std::string& command) {
    const std::string words = folder.path("words.jsonl");
    v1::IdentificationProgress end;
    begin(world, words);
    if (HasFatalFailure()) return end;
    const std::string control = std::string("'") + HAPTICCTL_PROGRAM + "' --server " + address;
    ChildProcess shell("/bin/bash", {"-c", control + " --json identify " + command + " > '" + words + "'"});
    const int code = shell.wait();
    expect(code == 0, "hapticctl ended with " + std::to_string(code) + ": " + shell.errors());
    v1::ListIdentificationsResponse all;
    const auto stub = v1::IdentificationService::NewStub(client->channel);
    EXPECT_TRUE(stub->ListIdentifications(call_context().get(), {}, &all).ok());
    if (all.identifications_size() > 0) end = all.identifications(0);
    expect(end.state() == v1::IDENTIFICATION_STATE_CONVERGED, "not converged");
    expect(!end.model().empty(), "no model");
    return end;
  }
  void expect(bool holds, const std::string& otherwise) {
    if (!holds) wrong_.push_back(otherwise);
  }
  void expect_near(const v1::IdentificationProgress& end, const std::string& name, double expected,
                   double tolerance) {
    const double value = parameter(end, name);
    expect(std::abs(value - expected) <= tolerance, name + " is " + std::to_string(value) + ", expected " +
                                                        std::to_string(expected) + " ± " +
                                                        std::to_string(tolerance));
  }
  static double parameter(const v1::IdentificationProgress& end, const std::string& name) {
    for (const v1::EstimatedParameter& parameter : end.parameters()) {
      if (parameter.name() == name) return parameter.value();
    }
    return NAN;
  }
  /// Judges the end: what was expected and did not come is a failure if the emulated world kept time. A tool
  /// of 9 g that rests for 3 ms of a stroke at 220 mm/s and jumps after it shows 0.2 N that no arm would.
  void judge(const v1::IdentificationProgress& end) {
    if (wrong_.empty() || HasFatalFailure()) return;
    std::string all;
    for (const std::string& text : wrong_) all += text + "\n";
    constexpr double kMaxPauseMs = 3.0;
    const double pause_ms = longest_pause_ms();
    if (pause_ms > kMaxPauseMs) {
      GTEST_SKIP() << "NO VERDICT: this machine let the emulated world stand still for " << pause_ms
                   << " ms; so it came to\n"
                   << all;
    }
    ADD_FAILURE() << all << "the world stood still for " << pause_ms << " ms at most\n" << end.DebugString();
  }

 private:
  void begin(Arguments world, const std::string& words) {
    world.insert(world.end(), {"--instructions", words});
    {
      const PriorityWhileStarting priority(20);
      ASSERT_NO_FATAL_FAILURE(start(world));
    }
    client->await([](const v1::RigState& s) { return device_is(s, v1::PART_STATE_READY); });
    client->await([this](const v1::RigState&) { return bias().ok(); });
    ASSERT_TRUE(client->load("tap_1d").ok());  // an identification is guarded as the scene before it was
  }
  /// Longest pause as the emulators say at their end.
  double longest_pause_ms() {
    daemon->signal(SIGTERM);
    daemon->wait();
    peers->signal(SIGTERM);
    peers->wait();
    const std::string before = "stood still for at most ";
    const std::size_t at = peers->errors().find(before);
    if (at == std::string::npos) {
      ADD_FAILURE() << "the emulators do not say whether they kept time: " << peers->errors();
      return 0.0;
    }
    return std::stod(peers->errors().substr(at + before.size()));
  }

  std::vector<std::string> wrong_;
};

TEST_F(InstructedIdentification, OfTheTool) {
  const auto end = identified({"--object", "none"}, "tool");
  expect_near(end, "mass_g", 9.35, 0.187);
  expect_near(end, "centre_z_mm", -60.0, 1.0);
  judge(end);
}

TEST_F(InstructedIdentification, OfAContact) {
  const auto end =
      identified({"--object", "sponge_cut", "--tip", "ball_bearing"}, "contact --object sponge --force 3");
  expect_near(end, "displacement_mm", 18.8, 1.9);
  judge(end);
}

TEST_F(InstructedIdentification, OfFriction) {
  const auto end =
      identified({"--object", "rubber_ball_3d", "--tip", "rod"}, "friction --object ball --tip rod");
  expect_near(end, "kinetic", 0.8, 0.08);
  judge(end);
}

TEST_F(InstructedIdentification, OfTheThreshold) {
  const auto end = identified({"--object", "none"}, "threshold --duration 8");
  // Noise of the sensor and of the motion it cannot follow; the shipped scenes use 0.02 to 0.15 N.
  expect_near(end, "threshold_n", 0.1525, 0.1475);
  judge(end);
}

TEST_F(InstructedIdentification, OfTheGains) {
  const auto end = identified({"--object", "sponge_block"}, "gains");
  expect_near(end, "proportional_gain", 1.2, 0.2);
  judge(end);
}

}  // namespace
}  // namespace hapticd::test
