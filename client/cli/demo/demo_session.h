#pragma once

#include <memory>
#include <string>
#include <vector>

#include "client/cli/demo/demo_press.h"
#include "client/cli/plot/recording.h"
#include "client/cli/session/session.h"
#include "client/cli/view/live_screen.h"

namespace hapticd::cli {

struct DemoOptions {
  std::string scene = "tap_1d";
  std::string object = "sponge_block";
  std::vector<double> targets_n_per_mm{0.3, 0.35, 0.5, 0.7};
  double force_n = 4.0;
  double hold_s = 2.0;
  std::string folder = "out/demo";
};

/// The demonstration: a simulated hand presses a simulated object, first as it is, then with one target
/// stiffness after the other, while the terminal shows what the hand feels. Writes recording.csv,
/// stiffness.svg and results.json. Throws Error or LocalError when it cannot be led to its end; how well a
/// target was rendered is reported, not judged.
class DemoSession {
 public:
  DemoSession(const DemoOptions& options, Session& session);
  ~DemoSession();
  void run();

 private:
  void prepare();
  void press_once(DemoPress press);
  /// Reads telemetry until `enough`; `state` is what is shown meanwhile.
  void follow_until(const std::string& state, double at_most_s, const std::function<bool()>& enough,
                    PressTrace* trace);
  void conclude();
  void say(const std::string& line) const;

  DemoOptions options_;
  Session& session_;
  client::Client client_;
  v1::RigInfo rig_;
  double object_stiffness_n_per_mm_ = 0.0;
  std::unique_ptr<client::TelemetryStream> stream_;
  std::unique_ptr<Recording> recording_;
  std::vector<DemoPress> presses_;
  LiveScreen screen_;
  bool live_ = false;
};

}  // namespace hapticd::cli
