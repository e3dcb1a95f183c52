// Identifications by the commands a user types, live over the vendor's library and the Net F/T
// box: the emulated person knows the words of the daemon and does what they ask for.

#include <pthread.h>
#include <sched.h>

#include <cmath>

#include "hapticd/v1/identification.grpc.pb.h"
#include "tests/integration/real_parts/emulated_rig_process.h"

namespace hapticd::test {
namespace {

/// Where it is permitted, what is started meanwhile is real-time, as rig and daemon are in a laboratory.
/// Otherwise a machine that others use too lets most ticks go by without a fresh force.
class PriorityWhileStarting {
 public:
  PriorityWhileStarting() {
    pthread_getschedparam(pthread_self(), &policy_, &parameter_);
    sched_param wanted{};
    wanted.sched_priority = 20;
    pthread_setschedparam(pthread_self(), SCHED_FIFO, &wanted);
  }
  ~PriorityWhileStarting() { pthread_setschedparam(pthread_self(), policy_, &parameter_); }
  PriorityWhileStarting(const PriorityWhileStarting&) = delete;
  PriorityWhileStarting& operator=(const PriorityWhileStarting&) = delete;

 private:
  int policy_ = SCHED_OTHER;
  sched_param parameter_{};
};

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
    EXPECT_EQ(code, 0) << shell.errors();
    v1::ListIdentificationsResponse all;
    const auto stub = v1::IdentificationService::NewStub(client->channel);
    EXPECT_TRUE(stub->ListIdentifications(call_context().get(), {}, &all).ok());
    if (all.identifications_size() > 0) end = all.identifications(0);
    EXPECT_EQ(end.state(), v1::IDENTIFICATION_STATE_CONVERGED) << end.DebugString();
    EXPECT_FALSE(end.model().empty()) << end.DebugString();
    return end;
  }
  static double parameter(const v1::IdentificationProgress& end, const std::string& name) {
    for (const v1::EstimatedParameter& parameter : end.parameters()) {
      if (parameter.name() == name) return parameter.value();
    }
    ADD_FAILURE() << "no " << name << "\n" << end.DebugString();
    return NAN;
  }

 private:
  void begin(Arguments world, const std::string& words) {
    world.insert(world.end(), {"--instructions", words});
    {
      const PriorityWhileStarting priority;
      ASSERT_NO_FATAL_FAILURE(start(world));
    }
    client->await([](const v1::RigState& s) { return device_is(s, v1::PART_STATE_READY); });
    client->await([this](const v1::RigState&) { return bias().ok(); });
    ASSERT_TRUE(client->load("tap_1d").ok());  // an identification is guarded as the scene before it was
  }
};

TEST_F(InstructedIdentification, OfTheTool) {
  const auto end = identified({"--object", "none"}, "tool");
  EXPECT_NEAR(parameter(end, "mass_g") / 9.35, 1.0, 0.02);
  EXPECT_NEAR(parameter(end, "centre_z_mm"), -60.0, 1.0);
}

TEST_F(InstructedIdentification, OfAContact) {
  const auto end =
      identified({"--object", "sponge_cut", "--tip", "ball_bearing"}, "contact --object sponge --force 3");
  EXPECT_NEAR(parameter(end, "displacement_mm"), 18.8, 1.9);
}

TEST_F(InstructedIdentification, OfFriction) {
  const auto end =
      identified({"--object", "rubber_ball_3d", "--tip", "rod"}, "friction --object ball --tip rod");
  EXPECT_NEAR(parameter(end, "kinetic"), 0.8, 0.08);
}

TEST_F(InstructedIdentification, OfTheThreshold) {
  const auto end = identified({"--object", "none"}, "threshold --duration 8");
  // Noise of the sensor and of the motion it cannot follow; the shipped scenes use 0.02 to 0.15 N.
  EXPECT_GT(parameter(end, "threshold_n"), 0.005);
  EXPECT_LT(parameter(end, "threshold_n"), 0.3);
}

TEST_F(InstructedIdentification, OfTheGains) {
  const auto end = identified({"--object", "sponge_block"}, "gains");
  EXPECT_NEAR(parameter(end, "proportional_gain"), 1.2, 0.2);
}

}  // namespace
}  // namespace hapticd::test
