#include <algorithm>
#include <chrono>
#include <cmath>
#include <memory>

#include "client/cpp/client.h"
#include "client/cpp/clock/clock_sync.h"
#include "tests/measure/bench/live/daemon_process.h"
#include "tests/measure/bench/pose/delaying_proxy.h"
#include "tests/measure/bench/pose/pose_figures.h"
#include "tests/measure/report/quantile.h"

namespace hapticd::bench {
namespace {

constexpr std::chrono::seconds kEventPatience{60};

/// Delays of a network, and the speed of the tap.
struct Network {
  const char* name;
  WayDelay there;
  WayDelay back;
  bool is_lan;
};

/// True instants of contact by the rig's clock, in ns: between two ticks, from depth and speed.
class TrueTouches {
 public:
  void take(const v1::TelemetrySample& sample) {
    const v1::TruthGroup& truth = sample.truth();
    const double now_s = 1e-9 * static_cast<double>(sample.time_ns());
    if (truth.in_contact() && now_s - free_since_s_ > 0.1) {
      const double approach = (last_z_mm_ - truth.tip_position_mm().z()) / std::max(1e-6, now_s - last_s_);
      const double inside_s =
          std::clamp(truth.displacement_mm() / std::max(1.0, approach), 0.0, now_s - last_s_);
      touches_ns_.push_back(sample.time_ns() - static_cast<std::int64_t>(1e9 * inside_s));
    }
    if (truth.in_contact()) free_since_s_ = now_s;
    last_s_ = now_s;
    last_z_mm_ = truth.tip_position_mm().z();
  }
  const std::vector<std::int64_t>& all() const { return touches_ns_; }

 private:
  std::vector<std::int64_t> touches_ns_;
  double free_since_s_ = 0.0;
  double last_s_ = 0.0;
  double last_z_mm_ = 0.0;
};

/// One touch as the client has it.
struct Seen {
  std::int64_t rig_ns = 0;
  std::int64_t client_ns = 0;  ///< by the client's clock
  double bound_ms = 0.0;
};

struct Errors {
  std::vector<double> ms;
  std::size_t touches = 0;
};

/// Taps for so long. The client converts the stamp of each touch to its own clock; the truth is converted by
/// the daemon's own relation of rig and machine, as both run on this machine.
Errors tap_and_compare(const std::filesystem::path& logs, const Network& network, double seconds,
                       double speed_mm_per_s) {
  const DaemonProcess daemon(logs / (std::string("hapticd_contact_") + network.name + ".log"));
  const std::string direct = daemon.address();
  std::unique_ptr<DelayingProxy> proxy, clock_proxy;
  if (network.is_lan) {
    const auto port = static_cast<std::uint16_t>(std::stoul(direct.substr(direct.rfind(':') + 1)));
    proxy = std::make_unique<DelayingProxy>(port, network.there, network.back);
    clock_proxy = std::make_unique<DelayingProxy>(port, network.there, network.back);
  }
  client::Client near({.address = direct, .timeout = kEventPatience});
  client::Client far({.address = proxy ? proxy->address() : direct, .timeout = kEventPatience});
  client::Client clock_client(
      {.address = clock_proxy ? clock_proxy->address() : direct, .timeout = kEventPatience});
  const client::ClockSync clock(clock_client);

  v1::HandProgram hand;
  hand.set_kind(v1::HAND_PROGRAM_KIND_TAP);
  hand.set_speed_mm_per_s(speed_mm_per_s);
  hand.set_rate_hz(0.977);
  hand.set_repetitions(-1);
  near.set_hand_program(hand);
  v1::SubscribeRequest truth_request;
  truth_request.add_groups(v1::FIELD_GROUP_TRUTH);
  client::TelemetryStream telemetry = near.subscribe(truth_request);
  v1::SubscribePosesRequest pose_request;
  pose_request.set_rate_hz(120.0);
  client::PoseStream poses = far.subscribe_poses(pose_request);

  TrueTouches touches;
  std::vector<Seen> seen;
  std::int64_t shift_ns = 0;  // daemon's clock minus the rig's
  v1::TelemetryBatch batch;
  v1::Pose pose;
  std::uint32_t number = 0;
  const auto end = std::chrono::steady_clock::now() + std::chrono::duration<double>(seconds);
  while (std::chrono::steady_clock::now() < end) {
    if (telemetry.next(batch, std::chrono::milliseconds(2)) == client::TelemetryStream::Event::kMessage) {
      for (const v1::TelemetrySample& sample : batch.samples()) touches.take(sample);
      batch.Clear();
    }
    while (poses.next(pose, std::chrono::milliseconds(0)) == client::PoseStream::Event::kMessage) {
      shift_ns = pose.time().daemon_ns() - pose.time().rig_ns();
      if (!pose.has_contact() || pose.contact().number() == number) continue;
      number = pose.contact().number();
      // The client knows the event by its own clock: the inverse of to_daemon at about now.
      const std::int64_t now_ns = client::ClockSync::now_ns();
      const client::DaemonTime now = clock.to_daemon(now_ns);
      seen.push_back({pose.contact().began().rig_ns(),
                      pose.contact().began().daemon_ns() - (now.daemon_ns - now_ns), now.bound_ms});
    }
  }
  Errors errors;
  errors.touches = touches.all().size();
  for (const std::int64_t truth_ns : touches.all()) {
    const auto nearest = std::min_element(seen.begin(), seen.end(), [&](const Seen& a, const Seen& b) {
      return std::abs(a.rig_ns - truth_ns) < std::abs(b.rig_ns - truth_ns);
    });
    if (nearest == seen.end() || std::abs(nearest->rig_ns - truth_ns) > 50'000'000) continue;
    errors.ms.push_back(1e-6 * static_cast<double>(nearest->client_ns - (truth_ns + shift_ns)));
  }
  return errors;
}

}  // namespace

void add_contact_events(const std::filesystem::path& logs, bool quick, const AddFigure& add) {
  const Network networks[] = {{"loopback", {}, {}, false},
                              {"emulated LAN", {0.05, 0.05}, {0.15, 0.10}, true},
                              {"emulated wireless", {1.0, 3.0}, {2.0, 6.0}, true}};
  for (const Network& network : networks) {
    for (const double speed : {100.0, 400.0}) {
      const Errors errors = tap_and_compare(logs, network, quick ? 12.0 : 60.0, speed);
      std::vector<double> size;
      for (const double e : errors.ms) size.push_back(std::abs(e));
      for (const double share : {0.5, 0.95, 1.0}) {
        report::Figure figure{"contact_event_error_ms",
                              {{"network", network.name}, {"speed_mm_per_s", speed}, {"quantile", share}}};
        figure.unit = "ms";
        if (share == 0.95 && std::string(network.name) != "emulated wireless") figure.goal = 1.0;
        if (size.empty()) {
          figure.failed = "none of " + std::to_string(errors.touches) + " touches was reported";
        } else {
          figure.value = report::quantile(size, share);
        }
        add(figure);
      }
    }
  }
}

}  // namespace hapticd::bench
