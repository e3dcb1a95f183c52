#include "tests/emulators/bench/emulated_bench.h"

#include <time.h>

#include <cmath>
#include <cstdlib>
#include <cstring>
#include <limits>
#include <thread>
#include <utility>

#include "hal/sim/device/arm.h"
#include "tests/support/system/monotonic_ns.h"
#include "tests/support/turn.h"

namespace hapticd::emulators {

namespace {

using hal::Quaternion;
using hal::Vector3;

// The vendor's axes in terms of the rig's and back. The rig's z is up, the vendor's y is; the vendor's z
// comes towards the user, who sits at the rig's negative y.
Vector3 to_vendor(const Vector3& rig) noexcept {
  return {rig.x, rig.z, -rig.y};
}
Vector3 to_rig(const Vector3& vendor) noexcept {
  return {vendor.x, -vendor.z, vendor.y};
}
/// Turns by -90° about x, before the tool's own.
Quaternion to_vendor(const Quaternion& q) noexcept {
  const double h = std::sqrt(0.5);
  return {h * (q.w + q.x), h * (q.x - q.w), h * (q.y + q.z), h * (q.z - q.y)};
}

struct Free {
  void operator()(void* memory) const noexcept { std::free(memory); }
};

}  // namespace

struct EmulatedBench::State {
  State(const BenchConfig& config_, Peers peers_, std::unique_ptr<sim::SimulatedRig> rig_)
      : config(config_),
        peers(std::move(peers_)),
        rig(std::move(rig_)),
        truths(static_cast<BenchTruth*>(std::malloc(config_.truth_capacity * sizeof(BenchTruth)))) {}

  const BenchConfig config;
  const Peers peers;
  const std::unique_ptr<sim::SimulatedRig> rig;
  const bool upright = config.turn.w == 1.0;
  std::thread thread;
  std::atomic<bool> stop{false};
  std::atomic<std::int64_t> began_ns{std::numeric_limits<std::int64_t>::min()};  ///< CLOCK_MONOTONIC

  // Filled by the bench's thread; what is counted is final.
  const std::unique_ptr<BenchTruth[], Free> truths;
  std::atomic<std::size_t> truth_count{0};
  std::atomic<std::uint64_t> truths_lost{0};
  std::atomic<std::uint64_t> turns{0};
  std::atomic<std::uint64_t> turns_missed{0};
  std::atomic<std::int64_t> longest_pause_ns{0};
  test::FreeAirJudge free_air;

  void run();
  void turn();
  void keep(const BenchTruth& truth);
};

void EmulatedBench::State::turn() {
  hal::RigSample sample;
  const std::int64_t before_ns = test::monotonic_ns();
  rig->read(sample);
  // A thread that is held up in between takes too little; a world that leaves time out begins later.
  if (before_ns - sample.time_ns > began_ns) began_ns = before_ns - sample.time_ns;  // of one writer
  if (peers.pose) {
    const Vector3 tip_mm = test::turned(config.turn, sample.tip_position_mm);
    const Quaternion orientation = test::product(config.turn, sample.tip_orientation);
    // An arm does not turn with the world: it reaches there with other angles.
    peers.pose(tip_mm, orientation, upright ? sample.angles : sim::angles_of({}, tip_mm, orientation));
  }
  if (peers.load) peers.load(sample.sensor_force_n, sample.sensor_torque_n_mm);
  Vector3 outside_mm;
  if (peers.instrument && rig->external_position(outside_mm)) {
    peers.instrument(test::turned(config.turn, outside_mm));
  }
  const Vector3 force_n =
      peers.force_n ? test::turned(test::inverse(config.turn), peers.force_n()) : Vector3{};
  rig->write({force_n});
  hal::TruthSample now;
  rig->truth(now);
  free_air.add(1e-9 * static_cast<double>(sample.time_ns), now.in_contact, std::sqrt(dot(force_n, force_n)));
  if (turns.fetch_add(1, std::memory_order_relaxed) % static_cast<std::uint64_t>(config.truth_every) == 0) {
    BenchTruth truth;
    truth.monotonic_ns = test::monotonic_ns();
    truth.time_ns = sample.time_ns;
    rig->truth(truth.truth);
    truth.encoder_position_mm = sample.tip_position_mm;
    truth.sensor_force_n = sample.sensor_force_n;
    truth.asked_force_n = force_n;
    keep(truth);
  }
}

void EmulatedBench::State::keep(const BenchTruth& truth) {
  const std::size_t count = truth_count.load(std::memory_order_relaxed);
  if (count >= config.truth_capacity) {
    truths_lost.fetch_add(1, std::memory_order_relaxed);
    return;
  }
  std::memcpy(static_cast<void*>(&truths[count]), &truth, sizeof truth);
  truth_count.store(count + 1, std::memory_order_release);
}

void EmulatedBench::State::run() {
  const auto period_ns = static_cast<std::int64_t>(1e9 / config.rate_hz);
  std::int64_t due_ns = test::monotonic_ns();
  while (!stop) {
    turn();
    due_ns += period_ns;
    const std::int64_t late_ns = test::monotonic_ns() - due_ns;
    if (late_ns > longest_pause_ns) longest_pause_ns = late_ns;  // of one writer
    if (late_ns > period_ns) {                                   // the physics catches up by itself
      const std::int64_t missed = late_ns / period_ns;
      due_ns += missed * period_ns;
      turns_missed.fetch_add(static_cast<std::uint64_t>(missed), std::memory_order_relaxed);
    }
    const timespec due{static_cast<time_t>(due_ns / 1'000'000'000),
                       static_cast<long>(due_ns % 1'000'000'000)};
    clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &due, nullptr);
  }
}

EmulatedBench::Peers EmulatedBench::peers_of(HdPage& page, const BenchConfig& config) {
  Peers peers;
  peers.pose = [&page, origin_mm = config.origin_mm, device = config.page_device](
                   const Vector3& tip_mm, const Quaternion& orientation, const hal::DeviceAngles& angles) {
    page.set_pose(to_vendor(tip_mm) + origin_mm, to_vendor(orientation), device);
    page.set_angles(angles.joint_rad, angles.gimbal_rad, device);
  };
  peers.force_n = [&page, device = config.page_device] { return to_rig(page.force_n(device)); };
  return peers;
}

hal::Result<std::unique_ptr<EmulatedBench>> EmulatedBench::create(const BenchConfig& config, HdPage& page,
                                                                  ForceSink sink) {
  Peers peers = peers_of(page, config);
  peers.load = std::move(sink);
  return create(config, std::move(peers));
}

hal::Result<std::unique_ptr<EmulatedBench>> EmulatedBench::create(const BenchConfig& config, Peers peers) {
  if (!(config.rate_hz >= 100.0 && config.rate_hz <= 10000.0) || config.truth_every < 1) {
    return hal::Error{"the bench's rate is out of range", "emulated bench", std::to_string(config.rate_hz),
                      "100 … 10000 Hz, a truth at least every turn", ""};
  }
  sim::SimulationConfig simulation = config.simulation;
  simulation.real_time = true;
  simulation.rate_hz = config.rate_hz;
  auto rig = sim::SimulatedRig::create(simulation);
  if (!rig) return rig.error();
  auto state = std::make_unique<State>(config, std::move(peers), std::move(*rig));
  if (state->truths == nullptr) {
    return hal::Error{"no memory for the truth", "emulated bench", std::to_string(config.truth_capacity), "",
                      ""};
  }
  state->turn();
  return std::unique_ptr<EmulatedBench>(new EmulatedBench(std::move(state)));
}

EmulatedBench::EmulatedBench(std::unique_ptr<State> state) : state_(std::move(state)) {}
EmulatedBench::~EmulatedBench() {
  stop();
}

void EmulatedBench::start() {
  if (state_->thread.joinable()) return;
  state_->stop = false;
  state_->thread = std::thread([state = state_.get()] { state->run(); });
}

void EmulatedBench::stop() {
  state_->stop = true;
  if (state_->thread.joinable()) state_->thread.join();
}

const hal::RigInfo& EmulatedBench::info() const noexcept {
  return state_->rig->info();
}
std::optional<hal::Error> EmulatedBench::set_program(const sim::HandProgram& program) {
  return state_->rig->set_program(program);
}
std::optional<hal::Error> EmulatedBench::set_object(const std::string& name) {
  return state_->rig->set_object(name);
}

std::optional<hal::Error> EmulatedBench::happen(const sim::ObjectEvent& event) {
  return state_->rig->happen(event);
}
const test::FreeAirJudge& EmulatedBench::free_air() const noexcept {
  return state_->free_air;
}

std::vector<sim::TrackerPose> EmulatedBench::tracker_poses() {
  std::vector<sim::TrackerPose> list;
  sim::TrackerPose pose;
  while (state_->rig->tracker().take(pose)) {
    pose.stamp_ns += state_->began_ns.load();
    list.push_back(pose);
  }
  return list;
}

std::size_t EmulatedBench::truth_count() const noexcept {
  return state_->truth_count.load(std::memory_order_acquire);
}
BenchTruth EmulatedBench::truth(std::size_t index) const {
  return state_->truths[index];
}
std::vector<BenchTruth> EmulatedBench::truth_from(std::size_t index) const {
  std::vector<BenchTruth> list;
  for (const std::size_t count = truth_count(); index < count; ++index) list.push_back(state_->truths[index]);
  return list;
}
std::optional<BenchTruth> EmulatedBench::latest() const {
  const std::size_t count = truth_count();
  if (count == 0) return std::nullopt;
  return state_->truths[count - 1];
}
std::uint64_t EmulatedBench::truths_lost() const noexcept {
  return state_->truths_lost;
}
std::uint64_t EmulatedBench::turns() const noexcept {
  return state_->turns;
}
std::uint64_t EmulatedBench::turns_missed() const noexcept {
  return state_->turns_missed;
}
double EmulatedBench::longest_pause_ms() const noexcept {
  return 1e-6 * static_cast<double>(state_->longest_pause_ns);
}

}  // namespace hapticd::emulators
