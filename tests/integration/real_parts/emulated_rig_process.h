#pragma once

#include <gtest/gtest.h>
#include <signal.h>
#include <stdlib.h>

#include <cmath>
#include <fstream>
#include <memory>
#include <set>
#include <sstream>
#include <string>
#include <vector>

#include "tests/emulators/openhaptics/page.h"
#include "tests/integration/daemon_process.h"
#include "tests/integration/running_service.h"
#include "tests/support/temporary_folder.h"

namespace hapticd::test {

using emulators::HdPage;
using Arguments = std::vector<std::string>;

inline const v1::PartReport& part(const v1::RigState& state, const std::string& name) {
  for (const v1::PartReport& report : state.parts()) {
    if (report.part() == name) return report;
  }
  return v1::PartReport::default_instance();
}
inline bool sensor_is(const v1::RigState& state, v1::PartState wanted) {
  return part(state, "force sensor").state() == wanted;
}
inline bool device_is(const v1::RigState& state, v1::PartState wanted) {
  return part(state, "haptic device").state() == wanted;
}

/// The number behind "key = " in a rig file.
inline std::string value_of(const std::string& key, const std::string& file) {
  std::ifstream lines(file);
  for (std::string line; std::getline(lines, line);) {
    if (line.rfind(key + " = ", 0) == 0) return line.substr(key.size() + 3);
  }
  ADD_FAILURE() << "no " << key << " in " << file;
  return "0";
}

/// Presses again and again: a daemon that comes late, with the tool on the object already, sees it free next
/// time.
const inline Arguments kPressingHand{"--program", "press", "--force-n", "2", "--hold-s", "12"};
const inline Arguments kHoldingHand{"--program", "press", "--force-n", "2", "--hold-s", "-1"};
const inline Arguments kRestingHand{"--program", "rest"};

/// The emulators' process, and the rig file it wrote.
class EmulatedRigProcess : public testing::Test {
 protected:
  void TearDown() override {
    for (const std::string& name : variables) unsetenv(name.c_str());
  }

  void start_peers(Arguments arguments) {
    arguments.insert(arguments.end(), {"--page", page_path, "--write", written});
    peers = std::make_unique<ChildProcess>(EMULATED_RIG, arguments);
    line_for_daemon = peers->read_line();
    ASSERT_NE(line_for_daemon, "") << "it did not start";
  }
  /// Starts the peers again after a death: what comes back is to be found where it was.
  void start_peers_again(Arguments arguments) {
    arguments.insert(arguments.end(), {"--udp-port", value_of("rdt_port", rig_file), "--http-port",
                                       value_of("http_port", rig_file)});
    start_peers(arguments);
  }
  /// The rig file for a machine that others use too: no privileges for the loop, and nothing that a pause of
  /// half a second would make a fault of.
  void complete_rig_file() {
    std::stringstream text;
    text << std::ifstream(written).rdbuf();
    std::string rig = text.str();
    const auto add = [&rig](const std::string& section, const std::string& keys) {
      const std::size_t at = rig.find(section + "\n");
      if (at != std::string::npos) rig.insert(at + section.size() + 1, keys);
    };
    add("[rig.netft]", "stale_after_ms = 1000\n");
    add("[rig.openhaptics]", "stall_s = 2\n");
    add("[rig.phantom]", "watchdog_ms = 1000\n");
    rig += "\n[loop]\nfifo_priority = 0\nlock_memory = false\nkeep_cpu_awake = false\n";
    rig += "\n[scene]\nfolder = \"" + folder.path() + "\"\n";
    rig +=
        "\n[guard]\nmax_target_stiffness_n_per_mm = 20\nmax_sensor_stale_after_ms = 1000\nmax_loop_gap_ms = "
        "1000\n";
    std::ofstream(rig_file) << rig;
    folder.write(
        "tap_1d.toml",
        "name = \"tap_1d\"\nkind = \"tap_1d\"\n[tool]\nmass_g = 9.35\n"
        "[target]\nstiffness_n_per_mm = 2\nmax_stiffness_n_per_mm = 20\n[structure]\ncompensation = true\n"
        "[guard]\nsensor_stale_after_ms = 1000\nloop_gap_ms = 1000\n");
    set_variables();
  }
  /// NAME='value', as the emulators print them before the daemon's name.
  void set_variables() {
    std::istringstream words(line_for_daemon);
    for (std::string word; words >> word;) {
      const std::size_t equals = word.find("='");
      if (equals == std::string::npos) break;
      variables.push_back(word.substr(0, equals));
      setenv(variables.back().c_str(), word.substr(equals + 2, word.size() - equals - 3).c_str(), 1);
    }
  }
  void start(const Arguments& peers_arguments, const Arguments& daemon_arguments = {}) {
    ASSERT_NO_FATAL_FAILURE(start_peers(peers_arguments));
    complete_rig_file();
    Arguments arguments{"--config", rig_file, "--listen", "127.0.0.1:0"};
    arguments.insert(arguments.end(), daemon_arguments.begin(), daemon_arguments.end());
    daemon = std::make_unique<DaemonProcess>(arguments);
    unsetenv("LD_PRELOAD");  // of the daemon, not of what else is started
    address = daemon->await_address();
    ASSERT_FALSE(address.empty());
    client = std::make_unique<ServiceClient>(connect(address));
  }
  void kill_peers() {
    peers->signal(SIGKILL);
    ASSERT_EQ(peers->wait(), -SIGKILL);
    peers = nullptr;
  }

  grpc::Status clear() const { return client->clear(); }
  grpc::Status bias() const {
    v1::BiasForceSensorResponse response;
    return client->rig->BiasForceSensor(call_context().get(), {}, &response);
  }
  grpc::Status unload() const {
    v1::UnloadSceneResponse response;
    return client->scene->UnloadScene(call_context().get(), {}, &response);
  }
  /// Looks at the stream until `condition` holds of a sample; fails the test when it never does.
  void await_sample(const std::function<bool(const v1::TelemetrySample&)>& condition) const {
    v1::SubscribeRequest request;
    request.add_groups(v1::FIELD_GROUP_GUARD);
    v1::TelemetrySample last;
    bool found = false;
    client->watch(request, [&](const v1::TelemetrySample& sample) {
      last = sample;
      found = condition(sample);
      return !found;
    });
    EXPECT_TRUE(found) << "waited in vain; the last sample was\n" << last.DebugString();
  }
  /// Topics of which the doctor, who opens the parts for it, finds something good.
  std::set<std::string> topics_that_are_well() const {
    v1::DiagnoseRequest request;
    request.set_probe(true);
    std::set<std::string> well;
    const v1::Diagnosis diagnosis = answer_of(*client->rig, &v1::RigService::Stub::Diagnose, request);
    for (const v1::Finding& finding : diagnosis.findings()) {
      if (finding.severity() == v1::FINDING_SEVERITY_GOOD) well.insert(finding.topic());
    }
    return well;
  }
  static double force_n(const v1::TelemetrySample& sample) {
    const v1::Vector3& force = sample.guard().device_command_n();
    return std::hypot(force.x(), force.y(), force.z());
  }
  /// What the motors really give.
  double motor_force_n() const {
    const hal::Vector3 force = HdPage(page_path, HdPage::Join{}).force_n();
    return std::sqrt(dot(force, force));
  }

  TemporaryFolder folder;
  TemporaryFolder memory{memory_folder()};
  const std::string page_path = memory.path("page");
  const std::string written = folder.path("emulated.toml");
  const std::string rig_file = folder.path("rig.toml");
  std::string line_for_daemon;
  std::vector<std::string> variables;  ///< of the environment, set for the daemon
  std::string address;
  std::unique_ptr<ChildProcess> peers;
  std::unique_ptr<DaemonProcess> daemon;
  std::unique_ptr<ServiceClient> client;
};

}  // namespace hapticd::test
