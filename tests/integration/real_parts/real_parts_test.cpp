// What a user with real parts does: bias, identify, exchange scenes, over the real transports.

#include <algorithm>
#include <atomic>
#include <chrono>
#include <filesystem>
#include <functional>
#include <thread>

#include "hapticd/v1/identification.grpc.pb.h"
#include "tests/integration/identification/identifying.h"
#include "tests/integration/real_parts/emulated_rig_process.h"

namespace hapticd::test {
namespace {

/// Measures for how long this machine leaves a thread that only sleeps without the processor.
class PauseMeter {
 public:
  ~PauseMeter() {
    ending_ = true;
    thread_.join();
  }
  /// The longest pause since this was asked last.
  double take_longest_ms() { return longest_ms_.exchange(0.0); }

 private:
  void run() {
    auto last = std::chrono::steady_clock::now();
    while (!ending_) {
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
      const auto now = std::chrono::steady_clock::now();
      longest_ms_ =
          std::max(longest_ms_.load(), std::chrono::duration<double, std::milli>(now - last).count());
      last = now;
    }
  }

  std::atomic<double> longest_ms_{0.0};
  std::atomic<bool> ending_{false};
  std::thread thread_{[this] { run(); }};
};

class RealParts : public EmulatedRigProcess {
 protected:
  v1::SensorBias biased() const {
    v1::BiasForceSensorResponse response;
    EXPECT_TRUE(ok(client->rig->BiasForceSensor(call_context().get(), {}, &response)));
    return response.bias();
  }
  /// Mean of the force along the tool over so many samples.
  double mean_force_n(int count = 300) const {
    v1::SubscribeRequest request;
    request.add_groups(v1::FIELD_GROUP_SAMPLE);
    double sum = 0.0;
    int seen = 0;
    client->watch(request, [&](const v1::TelemetrySample& sample) {
      if (sample.sample().force_count() == 0) return true;
      sum += sample.sample().sensor_force_n().z();
      return ++seen < count;
    });
    EXPECT_GE(seen, count);
    return sum / std::max(1, seen);
  }
  /// Runs a line of the shell. A guard takes a machine that stalls for a loop that hangs, and the table and
  /// the sensor refuse to go on: then, and only then, the user clears it and asks again.
  void run_line(const std::string& line) const {
    constexpr double kPauseMs = 20.0;
    PauseMeter pauses;
    for (const auto until = std::chrono::steady_clock::now() + 2 * kTimeout;;) {
      pauses.take_longest_ms();
      ChildProcess shell("/bin/bash", {"-c", "cd '" + folder.path() + "' && " + line});
      if (shell.wait() == 0) return;
      if (!client || pauses.take_longest_ms() < kPauseMs || std::chrono::steady_clock::now() > until) {
        ADD_FAILURE() << shell.output() << shell.errors();
        return;
      }
      client->await([this](const v1::RigState& state) {
        if (is_latched(state)) (void)clear();
        return state.guard_state() == v1::GUARD_STATE_RENDERING;
      });
    }
  }
  /// Starts an identification, lets `meanwhile` act, and returns the report once it is over.
  v1::IdentificationProgress watched(const v1::StartIdentificationRequest& request,
                                     const std::function<void()>& meanwhile = {}) const {
    const auto stub = v1::IdentificationService::NewStub(client->channel);
    v1::WatchIdentificationRequest watch;
    watch.set_identification(
        answer_of(*stub, &v1::IdentificationService::Stub::StartIdentification, request).identification());
    if (meanwhile) meanwhile();
    const auto context = call_context(std::chrono::minutes(4));
    v1::IdentificationProgress last;
    EXPECT_TRUE(ok(read_all(*stub->WatchIdentification(context.get(), watch), last)));
    return last;
  }
};

TEST_F(RealParts, ABiasOutlastsScenesAndTheirEnd) {
  // A sensor that reads half a newton of nothing, until it is biased and wherever that is lost.
  ASSERT_NO_FATAL_FAILURE(start({"--program", "rest", "--condition", "bias_error_z_n=0.5"}));
  ASSERT_TRUE(client->load("tap_1d").ok());
  EXPECT_NEAR(std::abs(mean_force_n()), 0.5, 0.1);
  ASSERT_TRUE(unload().ok());
  EXPECT_FALSE(client->state().has_sensor_bias());

  const v1::SensorBias bias = biased();
  EXPECT_FALSE(bias.id().empty());
  EXPECT_GT(bias.taken_at_unix_s(), 1'600'000'000);
  const v1::Quaternion& held = bias.tip_orientation();
  EXPECT_NEAR(held.w() * held.w() + held.x() * held.x() + held.y() * held.y() + held.z() * held.z(), 1.0,
              1e-6);
  for (const char* scene : {"tap_1d", "tap_1d", "wall", "tap_1d"}) {
    ASSERT_TRUE(client->load(scene).ok()) << scene;
    const v1::RigState state = client->state();
    EXPECT_EQ(state.sensor_bias().id(), bias.id()) << scene;
    EXPECT_EQ(state.sensor_bias_lost(), "");
    if (std::string(scene) == "tap_1d") {
      EXPECT_NEAR(mean_force_n(), 0.0, 0.1) << "after it was closed and opened again";
    }
  }
  ASSERT_TRUE(unload().ok());
  const v1::SensorBias again = biased();
  EXPECT_NE(again.id(), bias.id());
}

TEST_F(RealParts, AnIdentificationHoldsTheSensorAndFindsALaw) {
  ASSERT_NO_FATAL_FAILURE(start({"--program", "palpate", "--force-n", "3", "--hold-s", "1"}));
  biased();
  v1::StartIdentificationRequest request;
  request.mutable_contact()->set_force_n(3.0);
  request.set_object("sponge_hw");
  request.set_time_limit_s(14.0);
  const v1::IdentificationProgress end = watched(request);
  // How far it comes in this time is a matter of the machine; that it listens, and finds a law, is not.
  EXPECT_TRUE(end.state() == v1::IDENTIFICATION_STATE_CONVERGED ||
              end.state() == v1::IDENTIFICATION_STATE_PARTIAL)
      << end.DebugString();
  EXPECT_GT(end.samples(), 500U) << end.DebugString();
  ASSERT_FALSE(end.model().empty()) << end.DebugString();
  const double depth_mm = parameter_of(end, "displacement_mm").value();
  EXPECT_GT(depth_mm, 1.0);
  EXPECT_LT(depth_mm, 20.0);
  EXPECT_TRUE(sensor_is(client->state(), v1::PART_STATE_IDLE)) << "let go of again";
}

TEST_F(RealParts, WithoutABiasALoadIsNotIdentified) {
  ASSERT_NO_FATAL_FAILURE(start(kHoldingHand));
  v1::StartIdentificationRequest request;
  request.mutable_contact();
  request.set_object("sponge_hw");
  request.set_time_limit_s(30.0);
  const v1::IdentificationProgress end = watched(request);
  EXPECT_EQ(end.state(), v1::IDENTIFICATION_STATE_FAILED) << end.DebugString();
  EXPECT_NE(end.problem().what().find("never biased"), std::string::npos) << end.DebugString();
  EXPECT_LT(end.duration_s(), 20.0);
}

TEST_F(RealParts, AnIdentificationThatHearsNothingEndsWithTheReason) {
  ASSERT_NO_FATAL_FAILURE(start(kRestingHand));
  biased();
  v1::StartIdentificationRequest request;
  request.mutable_contact();
  request.set_object("sponge_hw");
  request.set_time_limit_s(600.0);
  const v1::IdentificationProgress last = watched(request, [this] {
    client->await([](const v1::RigState& s) { return sensor_is(s, v1::PART_STATE_READY); });
    kill_peers();
  });
  EXPECT_EQ(last.state(), v1::IDENTIFICATION_STATE_FAILED) << last.DebugString();
  EXPECT_FALSE(last.problem().what().empty());
  EXPECT_FALSE(last.problem().remedy().empty()) << last.DebugString();
}

/// The lines of the README that follow the one which checks the rig file, up to the end of the block.
std::vector<std::string> hardware_lines_of_readme() {
  std::ifstream readme(README_FILE);
  std::vector<std::string> lines;
  bool inside = false;
  for (std::string line; std::getline(readme, line);) {
    inside = inside || line.find("--check-config      #") != std::string::npos;
    if (inside && line.rfind("```", 0) == 0) break;
    if (inside) lines.push_back(line);
  }
  return lines;
}

TEST_F(RealParts, TheHardwareLinesOfTheReadmeWork) {
  const std::vector<std::string> lines = hardware_lines_of_readme();
  ASSERT_GE(lines.size(), 6U) << "check, start, doctor, bias, table, scene";
  ChildProcess drive(EMULATED_DRIVE, {"--tcp", "0"});
  const std::string reported = drive.read_line();  // "tcp 127.0.0.1:PORT unit 1"
  const std::size_t colon = reported.find(':');
  ASSERT_NE(colon, std::string::npos) << reported;
  const std::string port = reported.substr(colon + 1, reported.find(' ', colon) - colon - 1);

  ASSERT_NO_FATAL_FAILURE(start_peers(kRestingHand));
  complete_rig_file();
  std::ofstream(rig_file, std::ios::app)
      << "\n[rig.turntable]\nkind = \"modbus\"\nstale_after_s = 2\n[rig.turntable.interlock]\n"
      << "sensor_silence_s = 10\nloop_silence_s = 10\n[rig.turntable.modbus]\nhost = \"127.0.0.1\"\nport = "
      << port << "\nmap = \"plain_drive\"\n[rig.turntable.stations.sponge]\nangle_deg = 40.0\n";
  for (const auto& [name, program] :
       {std::pair{"hapticd", HAPTICD_PROGRAM}, {"hapticctl", HAPTICCTL_PROGRAM}}) {
    std::filesystem::create_symlink(program, folder.path(name));
  }
  for (std::string line : lines) {
    line = line.substr(0, line.find("  #"));
    SCOPED_TRACE(line);
    if (line.find("hapticd --config") != std::string::npos && line.find('&') != std::string::npos) {
      daemon = std::make_unique<DaemonProcess>(Arguments{"--config", rig_file, "--listen", "127.0.0.1:0"});
      const std::string address = daemon->await_address();
      setenv("HAPTICD_SERVER", address.c_str(), 1);
      client = std::make_unique<ServiceClient>(connect(address));
      continue;
    }
    run_line(line);
  }
  unsetenv("HAPTICD_SERVER");
  EXPECT_TRUE(client->state().has_sensor_bias());
  EXPECT_EQ(client->state().sensor_bias_lost(), "");
}

}  // namespace
}  // namespace hapticd::test
