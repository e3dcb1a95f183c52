#include <CLI/CLI.hpp>
#include <atomic>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <exception>

#include "client/igtl/bridge.h"
#include "proto/text/usage_message.h"
#include "proto/text/utf8_text.h"

namespace {

constexpr int kBadCommandLine = 2;

std::atomic<bool> stopping{false};
void stop(int) {
  stopping = true;
}

}  // namespace

int main(int argc, char** argv) {
  using namespace hapticd;
  igtl_bridge::BridgeOptions options;
  options.predict_ms = 0.0;
  options.daemon.timeout = std::chrono::seconds(1);  // a signal waits no longer than this
  CLI::App app("hapticd's poses for OpenIGTLink programs such as 3D Slicer and PLUS", "hapticd-igtl");
  app.set_version_flag("--version", HAPTICD_VERSION);
  app.add_option("--server", options.daemon.address, "Address of the daemon")
      ->envname("HAPTICD_SERVER")
      ->capture_default_str();
  app.add_option("--certificates", options.daemon.certificates,
                 "Folder of certificates, for a daemon elsewhere");
  app.add_option("--listen", options.host,
                 "Address that peers connect to; OpenIGTLink has neither encryption nor users")
      ->capture_default_str();
  app.add_option("--port", options.port, "Its port; 0 = any free one")->capture_default_str();
  app.add_option("--rate", options.rate_hz, "Poses a second, 1 to 1000")->capture_default_str();
  app.add_option("--predict", options.predict_ms, "ms ahead of the measurement, 0 to 100")
      ->capture_default_str();
  std::string frame = "rig";
  app.add_option("--frame", frame, "rig, device or reference")
      ->check(CLI::IsMember({"rig", "device", "reference"}))
      ->capture_default_str();
  app.add_option(
      "--reference", options.reference,
      "Name of the transforms of peers that go to the calibration that runs: the marker on the tool");
  std::string version = "peer";
  app.add_option("--header-version", version,
                 "OpenIGTLink's header that peers get: 1, 2, or peer: 1 until a peer sends 2 or 3")
      ->check(CLI::IsMember({"1", "2", "peer"}))
      ->capture_default_str();
  app.footer(
      "Sends TRANSFORM messages ToolToRig (ToolToDevice, ToolToReference) in mm, stamped with the UTC of "
      "the\n"
      "measurement, and a STATUS each second.\n\n"
      "Examples:\n  hapticd-igtl\n  hapticd-igtl --frame reference --rate 120 --predict 20 --listen 0.0.0.0\n"
      "  hapticd-igtl --reference StylusToTracker      while hapticctl calibrate runs");
  app.failure_message(text::usage_message);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : kBadCommandLine;
  }
  if (frame == "device") options.frame = v1::POSE_FRAME_DEVICE;
  if (frame == "reference") options.frame = v1::POSE_FRAME_REFERENCE;
  if (version == "1") options.sent = igtl_bridge::HeaderVersion::k1;
  if (version == "2") options.sent = igtl_bridge::HeaderVersion::k2;
  std::signal(SIGINT, stop);
  std::signal(SIGTERM, stop);
  try {
    igtl_bridge::Bridge bridge(options);
    std::printf("hapticd-igtl listens on %s:%u\n", options.host.c_str(), bridge.port());
    std::fflush(stdout);
    bridge.run(stopping);
    return 0;
  } catch (const client::Error& error) {
    std::fprintf(stderr, "hapticd-igtl: %s\n", error.what());
    return 1;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "hapticd-igtl: %s\n", text::printable(error.what()).c_str());
    return 3;
  }
}
