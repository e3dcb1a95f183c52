#include "client/igtl/bridge.h"

#include <chrono>
#include <cstdio>
#include <thread>

#include "proto/text/utf8_text.h"

namespace hapticd::igtl_bridge {

namespace {

using Clock = std::chrono::steady_clock;
constexpr std::chrono::milliseconds kWait{5};
constexpr std::chrono::seconds kStatusEvery{1};
constexpr std::chrono::seconds kRetryAfter{1};

std::int64_t utc_now_ns() {
  return std::chrono::duration_cast<std::chrono::nanoseconds>(
             std::chrono::system_clock::now().time_since_epoch())
      .count();
}

constexpr std::chrono::milliseconds kPushEvery{500};
/// Poses that the daemon may have sent while this program did something else: those of 10 s at the highest
/// rate.
constexpr int kMaxQueued = 10'000;
/// Poses that wait for a push; what comes beyond is left out.
constexpr int kMaxWaiting = 2000;

/// What the rig's state means to a peer.
std::pair<RigStatus, std::string> status_of(const v1::RigState& state, std::uint32_t sample_status) {
  if (!device_measures(sample_status)) {
    return {RigStatus::kDeviceFault, "the device does not measure: poses stay where they were"};
  }
  if (state.guard_state() == v1::GUARD_STATE_LATCHED || state.guard_state() == v1::GUARD_STATE_SUSPENDED) {
    return {RigStatus::kForceIsOff, "no force: " + v1::GuardFault_Name(state.guard_fault())};
  }
  return {RigStatus::kOk, "ready"};
}

}  // namespace

Bridge::Bridge(BridgeOptions options)
    : options_(std::move(options)),
      port_(options_.host, options_.port, options_.sent,
            {[this](const ReceivedTransform& transform) { take(transform); },
             [this](const std::string& line) { note_of_peer(line); }}) {}

void Bridge::note(const std::string& line) {
  // Peers name their transforms as they like.
  std::fprintf(stderr, "hapticd-igtl: %s\n", text::printable(line).c_str());
}

void Bridge::note_of_peer(const std::string& line) {
  const auto before = peer_notes_.take(Clock::now());
  if (!before) return;
  note(*before == 0 ? line : line + " (" + std::to_string(*before) + " more lines of peers before)");
}

void Bridge::take(const ReceivedTransform& transform) {
  if (options_.reference.empty() || transform.name != options_.reference) return;
  if (!transform.not_tracked.empty()) {
    if (not_tracked_ != transform.not_tracked) {
      note("poses of '" + transform.name + "' are left out while the peer's tracker does not see the tool (" +
           "TransformStatus " + transform.not_tracked + ", only OK is taken)");
    }
    not_tracked_ = transform.not_tracked;
    return;
  }
  if (transform.utc_ns == kNoTime) {
    const std::string words =
        "'" + transform.name + "' comes without time stamps: it cannot be used to calibrate";
    if (pushed_ != words) note(words);
    pushed_ = words;
    return;
  }
  if (references_.poses_size() >= kMaxWaiting) return;
  v1::ReferencePose& pose = *references_.add_poses();
  pose.set_stamp_ns(transform.utc_ns);
  pose.mutable_position_mm()->set_x(transform.position_mm[0]);
  pose.mutable_position_mm()->set_y(transform.position_mm[1]);
  pose.mutable_position_mm()->set_z(transform.position_mm[2]);
  pose.mutable_orientation()->set_w(transform.quaternion_wxyz[0]);
  pose.mutable_orientation()->set_x(transform.quaternion_wxyz[1]);
  pose.mutable_orientation()->set_y(transform.quaternion_wxyz[2]);
  pose.mutable_orientation()->set_z(transform.quaternion_wxyz[3]);
}

void Bridge::push_references(client::Client& client) {
  if (references_.poses_size() == 0) return;
  std::string words = "poses of '" + options_.reference + "' go to the calibration";
  try {
    client.push_reference_poses({references_});
  } catch (const client::Error& error) {
    if (error.kind() != client::ErrorKind::kRefused) throw;
    words = "poses of '" + options_.reference + "' are not taken: " + error.what();
  }
  references_.Clear();
  if (pushed_ != words) note(words);
  pushed_ = words;
}

void Bridge::report(RigStatus status, const std::string& words) {
  if (words != reported_) note(words);
  reported_ = words;
  port_.send(rig_status(status, words, utc_now_ns()));
}

void Bridge::run_connected(const std::atomic<bool>& stop) {
  client::Client client(options_.daemon);
  v1::SubscribePosesRequest request;
  request.set_rate_hz(options_.rate_hz);
  request.set_predict_ms(options_.predict_ms);
  request.set_frame(options_.frame);
  client::PoseStream poses = client.subscribe_poses(request);
  v1::Pose pose;
  auto next_status = Clock::now();
  auto next_push = Clock::now();
  while (!stop.load()) {
    port_.serve();
    // The newest of those that have come.
    auto event = poses.next(pose, kWait);
    const bool has_new = event == client::PoseStream::Event::kMessage;
    for (int i = 0; i < kMaxQueued && event == client::PoseStream::Event::kMessage; ++i)
      event = poses.next(pose, std::chrono::milliseconds(0));
    if (has_new) port_.send(tool_transform(pose));
    if (event == client::PoseStream::Event::kEnded) return;
    if (Clock::now() >= next_push) {
      next_push = Clock::now() + kPushEvery;
      push_references(client);
    }
    if (Clock::now() >= next_status) {
      next_status = Clock::now() + kStatusEvery;
      const auto [status, words] =
          status_of(client.rig_state(client::Histograms::kWithout), pose.status_bits());
      report(status, words);
    }
  }
}

void Bridge::run(const std::atomic<bool>& stop) {
  while (!stop.load()) {
    try {
      run_connected(stop);
    } catch (const client::Error& error) {
      const bool is_away = error.kind() == client::ErrorKind::kUnreachable ||
                           error.kind() == client::ErrorKind::kTimedOut ||
                           error.detail().reason() == v1::ERROR_REASON_UNAVAILABLE;
      if (!is_away) throw;
      report(RigStatus::kUnreachable, std::string("the daemon does not answer: ") + error.what());
    }
    const auto until = Clock::now() + kRetryAfter;
    while (!stop.load() && Clock::now() < until) {
      port_.serve();
      std::this_thread::sleep_for(kWait);
    }
  }
}

}  // namespace hapticd::igtl_bridge
