#include "tests/emulated_rig/board_rig.h"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <stdexcept>
#include <thread>
#include <utility>

#include "tests/emulated_rig/board_parts.h"
#include "tests/support/turn.h"
#include "tests/support/value_of.h"

namespace hapticd::test {

namespace {

constexpr double kWorldHz = 10'000.0;
constexpr int kTurnsATick = 10;
constexpr std::int64_t kTurnNs = 100'000;
constexpr double kTurnUs = 100.0;

/// The device's frame lies so that the hand's home is the arm's reset pose.
constexpr hal::Vector3 kShoulderMm{-215.0, 0.0, 180.0};

phantom::PhantomConfig device_like(const hal::DeviceInfo& simulated) {
  phantom::PhantomConfig config;
  config.origin_mm = kShoulderMm;
  config.gimbal = true;
  config.max_force_n = simulated.max_force_n;
  config.max_continuous_force_n = simulated.max_continuous_force_n;
  config.apparent_mass_g = simulated.apparent_mass_g;
  config.structural_stiffness_n_per_mm = simulated.structural_stiffness_n_per_mm;
  config.structural_mode_hz = simulated.structural_mode_hz;
  config.coulomb_friction_n = simulated.coulomb_friction_n;
  return config;
}

}  // namespace

BoardRig::BoardRig(const RunConfig& config) : late_us_(config.late_us) {
  sim::SimulationConfig simulation = config.simulation;
  simulation.rate_hz = kWorldHz;
  simulation.real_time = false;
  world_ = value_of(sim::SimulatedRig::create(simulation));

  emulators::ScriptedBoardConfig board;
  board.arm.shoulder_mm = kShoulderMm;
  board_ = std::make_shared<emulators::ScriptedBoard>(board);
  phantom::PhantomConfig arm = device_like(world_->info().device);
  place_arm(config, arm);

  hal::RigParts parts;
  parts.sensor = sensor_on(board_, folder_, simulation.tool_mass_g);
  if (config.instrument_mm_per_v > 0.0) {
    instrument_v_per_mm_ = 1.0 / config.instrument_mm_per_v;
    parts.instrument = instrument_on(board_, config.instrument_mm_per_v);
  }
  auto device = value_of(phantom::PhantomDevice::create(arm, board_));
  device_ = device.get();
  parts.device = std::move(device);
  composed_ = std::make_unique<hal::ComposedRig>(std::move(parts), 1000.0);
  demand(composed_->engage(hal::RigPartKind::kForceSensor));  // biased meanwhile, in real time
  demand(composed_->engage_instrument());
  board_->freeze_time();
  started_ns_ = board_->now_ns();
  demand(composed_->engage(hal::RigPartKind::kDevice));

  compose(config, *composed_, [this] { return output_n(); });
  rig().change_samples([this](hal::RigSample& sample) {
    sample.time_ns = board_->now_ns() - started_ns_;
    if (tamper_) tamper_(sample);
  });
  demand(device_->home());
  for (int k = 0; k < 1000 && !device_->homed(); ++k) {
    board_->advance_ns(kTurnsATick * kTurnNs);
    hal::RigSample sample;
    rig().read(sample);
    rig().write({});
  }
  if (!device_->homed()) throw std::runtime_error("the device could not be homed");
}

BoardRig::~BoardRig() = default;

// The arm is homed where it begins: at its reset pose, or, in a world that is turned, at the hand.
void BoardRig::place_arm(const RunConfig& config, phantom::PhantomConfig& arm) {
  board_->move_joints({});
  const hal::Quaternion& q = config.turn;
  if (q.x == 0.0 && q.y == 0.0 && q.z == 0.0) return;
  hal::RigSample sample;
  world_->read(sample);
  world_->write({});
  board_->move_tip(turned(q, sample.tip_position_mm));
  board_->orient(product(q, sample.tip_orientation));
  arm.reset_pose_rad = board_->arm().joints(turned(q, sample.tip_position_mm));
  arm.gimbal_reset_rad = board_->arm().gimbal(arm.reset_pose_rad, product(q, sample.tip_orientation));
}

void BoardRig::set_hand(const sim::HandProgram& program) {
  demand(world_->set_program(program));
}

double BoardRig::output_n() const {
  return magnitude(board_->tip_force_n());
}

void BoardRig::move_world() {
  hal::RigSample sample;
  world_->read(sample);
  board_->move_tip(turned(turn(), sample.tip_position_mm));
  board_->orient(product(turn(), sample.tip_orientation));
  board_->feed(sample.sensor_force_n, sample.sensor_torque_n_mm);
  hal::Vector3 outside_mm;
  if (instrument_v_per_mm_ > 0.0 && world_->external_position(outside_mm)) {
    const hal::Vector3 volts = turned(turn(), outside_mm) * instrument_v_per_mm_;
    board_->put_spare({volts.x, volts.y, volts.z});
  }
  board_->advance_ns(kTurnNs);
  world_->write({turned(inverse(turn()), board_->tip_force_n())});
  time_s_ += 1e-9 * static_cast<double>(kTurnNs);
}

void BoardRig::tick() {
  int turns = kTurnsATick;
  if (!late_us_.empty()) {
    const double late_us = late_us_[next_late_++ % late_us_.size()];
    turns += static_cast<int>(std::lround((late_us - behind_us_) / kTurnUs));
    turns = std::max(1, turns);
    behind_us_ += (turns - kTurnsATick) * kTurnUs;
  }
  for (int turn = 0; turn < turns; ++turn) move_world();
  hal::RigSample sample;
  rig().read(sample);
  rig().write(engine().on_tick(sample));
  world_->truth(truth_);
  drain();
}

void BoardRig::pass_without_tick(double seconds) {
  const double end_s = time_s_ + seconds;
  while (time_s_ < end_s) move_world();
}

// The caller waits for the loop, which here is the caller's own thread: so someone else asks.
rt::EngineOutcome BoardRig::execute(const rt::EngineCommand& command) {
  rt::EngineOutcome outcome;
  std::atomic<bool> done{false};
  std::thread asker([&] {
    outcome = engine().execute(command, std::chrono::seconds(10));
    done = true;
  });
  while (!done) {
    std::this_thread::sleep_for(std::chrono::milliseconds(2));
    if (!done) tick();
  }
  asker.join();
  return outcome;
}

}  // namespace hapticd::test
