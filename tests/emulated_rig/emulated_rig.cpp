#include "tests/emulated_rig/emulated_rig.h"

#include <chrono>
#include <cstdlib>
#include <string>
#include <thread>
#include <utility>

#include "hal/netft/netft_sensor.h"
#include "hal/openhaptics/openhaptics_device.h"
#include "tests/emulated_rig/board_parts.h"
#include "tests/support/system/monotonic_ns.h"
#include "tests/support/system/priority_while_starting.h"
#include "tests/support/value_of.h"

namespace hapticd::test {

namespace {

emulators::NetFtBoxSettings fed_box() {
  emulators::NetFtBoxSettings settings;
  settings.fed = true;
  return settings;
}

/// The driver's name of the simulated device.
std::string model_of(const std::string& simulated) {
  return simulated == "phantom_1_0" ? "phantom_premium_1_0" : "phantom_premium_1_5_high_force";
}

std::unique_ptr<hal::HapticDevice> device_on(const hal::DeviceInfo& simulated, double stall_s) {
  openhaptics::OpenHapticsConfig config;
  config.vendor_library_names = std::string(HD_STAND_IN_FOLDER) + "/libHD_stand_in.so";
  config.model = model_of(simulated.model);
  config.structural_stiffness_n_per_mm = simulated.structural_stiffness_n_per_mm;
  config.structural_mode_hz = simulated.structural_mode_hz;
  config.stall_s = stall_s;
  return value_of(openhaptics::OpenHapticsDevice::create(config));
}

std::unique_ptr<hal::ForceSensor> sensor_on(const emulators::NetFtBox& box, double tool_mass_g,
                                            int fifo_priority) {
  netft::NetFtConfig config;
  config.address = "127.0.0.1";
  config.rdt_port = box.udp_port();
  config.http_port = box.http_port();
  config.bias = netft::BiasBy::kNone;  // the simulated sensor is biased with its tool upright
  config.tool_mass_g = tool_mass_g;
  config.fifo_priority = fifo_priority;
  return value_of(netft::NetFtSensor::create(config));
}

}  // namespace

EmulatedRig::EmulatedRig(const EmulatedRigConfig& config) {
  const PriorityWhileStarting priority(config.fifo_priority);
  page_ = std::make_unique<emulators::HdPage>(folder_.path("page"));
  setenv("HD_STAND_IN_PAGE", page_->path().c_str(), 1);
  page_->set_late_ticks(config.late_us);
  const bool has_instrument = config.instrument_mm_per_v > 0.0;
  if (config.sensor_on_board || has_instrument) board_ = std::make_shared<emulators::ScriptedBoard>();
  if (!config.sensor_on_board) box_ = std::make_unique<emulators::NetFtBox>(fed_box());
  emulators::BenchConfig bench;
  bench.simulation = config.simulation;
  bench.turn = config.turn;
  emulators::EmulatedBench::Peers peers = emulators::EmulatedBench::peers_of(*page_, bench);
  peers.load = [this](const hal::Vector3& force_n, const hal::Vector3& torque_n_mm) {
    box_ ? feed(force_n, torque_n_mm) : board_->feed(force_n, torque_n_mm);
  };
  if (has_instrument) {
    peers.instrument = [this, per_mm = 1.0 / config.instrument_mm_per_v](const hal::Vector3& tip_mm) {
      board_->put_spare({tip_mm.x * per_mm, tip_mm.y * per_mm, tip_mm.z * per_mm});
    };
  }
  bench_ = value_of(emulators::EmulatedBench::create(bench, std::move(peers)));
  const hal::DeviceInfo& simulated = bench_->info().device;
  page_->device().max_force_n = simulated.max_force_n;
  page_->device().max_continuous_force_n = simulated.max_continuous_force_n;
  bench_->start();

  hal::RigParts parts;
  parts.device = device_on(simulated, config.stall_s);
  if (box_) {
    parts.sensor = sensor_on(*box_, config.simulation.tool_mass_g, config.fifo_priority);
  } else {
    parts.sensor = sensor_on(board_, folder_, config.simulation.tool_mass_g);
  }
  if (has_instrument) parts.instrument = instrument_on(board_, config.instrument_mm_per_v);
  composed_ = std::make_unique<hal::ComposedRig>(std::move(parts), 1000.0);
  demand(composed_->engage(hal::RigPartKind::kDevice));
  demand(composed_->engage(hal::RigPartKind::kForceSensor));
  demand(composed_->engage_instrument());

  compose(config, *composed_, [this] { return magnitude(page_->force_n()); });
  rig().change_samples([this](hal::RigSample& sample) {
    constexpr std::int64_t kYoungNs = 1'000'000;
    if (!forgives_.load() || sample.force_age_ns <= kYoungNs) return;
    sample.force_age_ns = kYoungNs;
    forgiven_.fetch_add(1);
  });
  rt::LoopConfig loop;
  loop.fifo_priority = config.fifo_priority;
  loop.lock_memory = false;  // of a program that does much besides
  loop_ = std::make_unique<rt::PeriodicLoop>(rig(), engine(), loop);
  loop_->start();
}

EmulatedRig::~EmulatedRig() {
  loop_ = nullptr;
  bench_->stop();
  composed_ = nullptr;
  bench_ = nullptr;  // before its page
  unsetenv("HD_STAND_IN_PAGE");
}

void EmulatedRig::set_hand(const sim::HandProgram& program) {
  demand(bench_->set_program(program));
}

rt::EngineOutcome EmulatedRig::execute(const rt::EngineCommand& command) {
  return engine().execute(command, std::chrono::seconds(5));
}

void EmulatedRig::before_record(std::function<void()> action) {
  const std::lock_guard lock(action_mutex_);
  action_ = std::move(action);
  sent_ns_.store(0);
  action_waits_.store(true);
}

std::optional<std::int64_t> EmulatedRig::sent_ns() const noexcept {
  const std::int64_t sent = sent_ns_.load();
  if (sent == 0) return std::nullopt;
  return sent;
}

void EmulatedRig::feed(const hal::Vector3& force_n, const hal::Vector3& torque_n_mm) {
  if (!action_waits_.load()) {
    box_->feed(force_n, torque_n_mm);
    return;
  }
  const std::lock_guard lock(action_mutex_);
  action_();
  box_->feed(force_n, torque_n_mm);
  sent_ns_.store(monotonic_ns());
  action_waits_.store(false);
}

void EmulatedRig::step() {
  std::this_thread::sleep_for(std::chrono::milliseconds(1));
}

double EmulatedRig::now_s() const {
  return 1e-9 * static_cast<double>(monotonic_ns());
}

}  // namespace hapticd::test
