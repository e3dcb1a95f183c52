#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>
#include <iomanip>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "tests/integration/running_service.h"
#include "tests/support/calibration/registration_trial.h"
#include "tests/support/child_process.h"
#include "tests/support/temporary_folder.h"

namespace hapticd::test {
namespace {

/// A trial as the files that `hapticctl telemetry record` and a tracker would leave; the tracker's clock
/// is ahead and gains.
struct TrialFiles {
  TrialFiles(const study::RegistrationTrial& trial, double clock_gains, double clock_ahead_s = 0.0) {
    std::ofstream rig(folder.path("rig.csv"));
    rig << std::setprecision(17)
        << "tick,time_s,sample_tip_position_x_mm,sample_tip_position_y_mm,sample_tip_position_z_mm,"
           "sample_orientation_w,sample_orientation_x,sample_orientation_y,sample_orientation_z";
    for (const char* kind : {"joint", "gimbal"}) {
      for (int i = 1; i <= 3; ++i) rig << ",angles_" << kind << '_' << i << "_rad";
    }
    rig << '\n';
    int tick = 0;
    for (const auto& pose : trial.rig.poses()) {
      rig << tick++ << ',' << pose.time_s;
      for (const double value : pose.tip_mm) rig << ',' << value;
      const Eigen::Quaterniond& q = pose.orientation;
      rig << ',' << q.w() << ',' << q.x() << ',' << q.y() << ',' << q.z();
      for (const double angle : pose.angles.joint_rad) rig << ',' << angle;
      for (const double angle : pose.angles.gimbal_rad) rig << ',' << angle;
      rig << '\n';
    }
    std::ofstream tracker(folder.path("tracker.csv"));
    tracker << std::setprecision(17) << "stamp_s,x_mm,y_mm,z_mm,qw,qx,qy,qz\n";
    const double begin_s = trial.reference.front().stamp_s;
    for (const auto& pose : trial.reference) {
      tracker << clock_ahead_s + begin_s + (1.0 + clock_gains) * (pose.stamp_s - begin_s);
      for (const double value : pose.position_mm) tracker << ',' << value;
      const Eigen::Quaterniond q = pose.orientation.value_or(Eigen::Quaterniond::Identity());
      tracker << ',' << q.w() << ',' << q.x() << ',' << q.y() << ',' << q.z() << '\n';
    }
  }
  TemporaryFolder folder;
};

/// `hapticctl calibrate kinematics` of these files.
std::unique_ptr<ChildProcess> calibrate(const RunningService& service, const TrialFiles& files,
                                        const std::vector<std::string>& more) {
  std::vector<std::string> words{"--server", service.address(), "--timeout", "120", "--json", "calibrate"};
  words.insert(words.end(), {"kinematics", "--recording", files.folder.path("rig.csv"), "--reference",
                             files.folder.path("tracker.csv")});
  words.insert(words.end(), more.begin(), more.end());
  return std::make_unique<ChildProcess>(HAPTICCTL_BINARY, words);
}

nlohmann::json made(const RunningService& service, const TrialFiles& files,
                    const std::vector<std::string>& more) {
  const auto command = calibrate(service, files, more);
  EXPECT_EQ(command->wait(), 0) << command->output() << command->errors();
  return nlohmann::json::parse(command->output());
}

TEST(CalibrateCli, MakesACalibrationOfFiles) {
  const RunningService service;
  const auto trial = study::record_trial({.seed = 23, .calibration_s = 40.0, .held_out_s = 1.0});
  constexpr double kDrift = 200e-6;
  const TrialFiles files(trial, kDrift);
  const nlohmann::json found = made(service, files, {"--own-clock"});
  EXPECT_LT(found.at("predicted_target_error_95_mm"), 1.0);
  const auto& parameters = found.at("parameters");
  const auto drift = std::find_if(parameters.begin(), parameters.end(),
                                  [](const auto& one) { return one.at("name") == "tracker_clock_drift"; });
  ASSERT_NE(drift, parameters.end()) << found;
  EXPECT_NEAR(drift->at("value"), kDrift * 1e6, 0.1 * kDrift * 1e6);
  EXPECT_EQ(drift->at("unit"), "ppm");
  const double latency_ms = found.at("latency_ms");
  EXPECT_NEAR(latency_ms, 1e3 * trial.latency_s, 0.5);
  // Without, the clocks are taken for one: half of what they differ by at the end is taken for latency.
  const double span_s = trial.reference.back().stamp_s - trial.reference.front().stamp_s;
  EXPECT_NEAR(made(service, files, {}).at("latency_ms").get<double>() - latency_ms, 0.5e3 * kDrift * span_s,
              1.0);

  // The clock of day: nothing falls together unless it is looked for.
  const TrialFiles utc(trial, 20e-6, 1.76e9);
  EXPECT_LT(made(service, utc, {"--own-clock"}).at("predicted_target_error_95_mm"), 1.0);
  const auto refused = calibrate(service, utc, {});
  EXPECT_NE(refused->wait(), 0);
  EXPECT_NE(refused->output().find("do not fall together in time"), std::string::npos)
      << refused->output() << refused->errors();
}

}  // namespace
}  // namespace hapticd::test
