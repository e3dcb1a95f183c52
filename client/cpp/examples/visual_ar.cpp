// A visual AR system: where to draw the tool in the picture that is seen in 20 ms.
//   visual_ar ADDRESS [PICTURES]      exit code 0: all pictures had a pose; 1: error
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <thread>

#include "client/cpp/client.h"
#include "client/cpp/clock/clock_sync.h"

namespace v1 = hapticd::v1;
using hapticd::client::PoseStream;

int main(int argc, char** argv) try {
  hapticd::client::Client client({.address = argc > 1 ? argv[1] : hapticd::client::kDefaultAddress});
  const hapticd::client::ClockSync clock(client);
  v1::SubscribePosesRequest request;
  request.set_rate_hz(120.0);
  request.set_predict_ms(20.0);
  PoseStream poses = client.subscribe_poses(request);

  v1::Pose pose;
  std::int64_t last_contact = 0;
  for (long left = argc > 2 ? std::atol(argv[2]) : 600; left > 0; --left) {
    // The newest of those that have come, and the first one if none has.
    auto event = poses.next(pose, std::chrono::seconds(5));
    while (event == PoseStream::Event::kMessage) event = poses.next(pose, std::chrono::milliseconds(0));
    if (event == PoseStream::Event::kEnded || !pose.has_position_mm()) return 1;
    std::printf("tip %8.2f %8.2f %8.2f mm, +-%.2f mm\n", pose.position_mm().x(), pose.position_mm().y(),
                pose.position_mm().z(), pose.prediction().error_mm());
    if (pose.contact().number() != last_contact) {
      last_contact = pose.contact().number();
      // By this machine's clock: how long ago the tip touched.
      const auto now = clock.to_daemon(hapticd::client::ClockSync::now_ns());
      std::printf("touched %.1f ms ago, +-%.3f ms\n",
                  1e-6 * static_cast<double>(now.daemon_ns - pose.contact().began().daemon_ns()),
                  now.bound_ms);
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(16));  // draw
  }
  return 0;
} catch (const hapticd::client::Error& error) {
  std::fprintf(stderr, "%s\n", error.what());
  return 1;
}
