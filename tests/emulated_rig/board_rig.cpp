#include "tests/emulated_rig/board_rig.h"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <stdexcept>
#include <string>
#include <thread>
#include <utility>

#include "hal/daq/daq_sensor.h"
#include "tests/support/value_of.h"

namespace hapticd::test {

namespace {

constexpr double kWorldHz = 10'000.0;
constexpr int kTurnsATick = 10;
constexpr std::int64_t kTurnNs = 100'000;

/// The device's frame lies so that the hand's home is the arm's reset pose.
constexpr hal::Vector3 kShoulderMm{-215.0, 0.0, 180.0};

phantom::PhantomConfig device_like(const hal::DeviceInfo& simulated) {
  phantom::PhantomConfig config;
  config.origin_mm = kShoulderMm;
  config.max_force_n = simulated.max_force_n;
  config.max_continuous_force_n = simulated.max_continuous_force_n;
  config.apparent_mass_g = simulated.apparent_mass_g;
  config.structural_stiffness_n_per_mm = simulated.structural_stiffness_n_per_mm;
  config.coulomb_friction_n = simulated.coulomb_friction_n;
  return config;
}

}  // namespace

BoardRig::BoardRig(const RunConfig& config) {
  sim::SimulationConfig simulation = config.simulation;
  simulation.rate_hz = kWorldHz;
  simulation.real_time = false;
  world_ = value_of(sim::SimulatedRig::create(simulation));

  emulators::ScriptedBoardConfig board;
  board.arm.shoulder_mm = kShoulderMm;
  board_ = std::make_shared<emulators::ScriptedBoard>(board);
  board_->move_joints({});

  daq::DaqSensorConfig sensor;
  sensor.calibration_file = folder_.write("sensor.cal", board_->gauges().calibration_file({}));
  sensor.tool_mass_g = simulation.tool_mass_g;
  hal::RigParts parts;
  parts.sensor = value_of(daq::DaqSensor::create(sensor, board_));
  auto device = value_of(phantom::PhantomDevice::create(device_like(world_->info().device), board_));
  device_ = device.get();
  parts.device = std::move(device);
  composed_ = std::make_unique<hal::ComposedRig>(std::move(parts), 1000.0);
  demand(composed_->engage(hal::RigPartKind::kForceSensor));  // biased meanwhile, in real time
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

void BoardRig::set_hand(const sim::HandProgram& program) {
  demand(world_->set_program(program));
}

double BoardRig::output_n() const {
  return magnitude(board_->tip_force_n());
}

void BoardRig::move_world() {
  hal::RigSample sample;
  world_->read(sample);
  board_->move_tip(sample.tip_position_mm);
  board_->feed(sample.sensor_force_n, sample.sensor_torque_n_mm);
  board_->advance_ns(kTurnNs);
  world_->write({board_->tip_force_n()});
  time_s_ += 1e-9 * static_cast<double>(kTurnNs);
}

void BoardRig::tick() {
  for (int turn = 0; turn < kTurnsATick; ++turn) move_world();
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

// The caller waits for the loop, which here is the caller's own thread: so somebody else asks.
rt::EngineOutcome BoardRig::clear() {
  rt::EngineCommand command;
  command.kind = rt::EngineCommand::Kind::kClear;
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
