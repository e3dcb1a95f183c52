#include "hal/sim/simulated_rig.h"

#include <atomic>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <thread>
#include <utility>

#include "hal/lock/mutex.h"
#include "hal/shown_text.h"
#include "hal/sim/object/general_object_model.h"
#include "hal/sim/sensor/external_instrument.h"
#include "hal/sim/sensor/sensor_bias.h"
#include "hal/sim/simulated_info.h"
#include "hal/sim/simulation.h"
#include "hal/sim/simulation_limits.h"
#include "hal/sim/tick_clock.h"

namespace hapticd::sim {

namespace {

using hal::Vector3;
using Clock = std::chrono::steady_clock;

/// One change of the world, prepared by any thread and taken over between two reads.
struct Change {
  std::unique_ptr<PreparedHand> hand;
  bool replaces_object = false;
  std::unique_ptr<PlacedObject> object;
  Change* next_retired = nullptr;
};

}  // namespace

struct SimulatedRig::State {
  State(const SimulationConfig& config_, const DeviceModel& model, Tip tip_, Plant plant_,
        const Conditions& conditions)
      : config(config_),
        tip(tip_),
        plant(plant_),
        clock(config_.rate_hz, conditions, config_.real_time ? nullptr : config_.ticks, config_.seed),
        simulation(model, 1e-3 * config_.tool_mass_g * (1.0 + conditions.tool_mass_error_share), config_.seed,
                   {config_.tool_centre_mm, config_.sensor_to_tool, config_.sensor_force_offset_n,
                    config_.sensor_torque_offset_n_mm},
                   Simulation::kStepS, conditions, clock.irregular()),
        instrument({}, config_.seed ^ 0x6c766474ULL),
        tracker(conditions, config_.seed),
        resting_hand(simulation.prepare(HandProgram{})) {}
  ~State() {
    delete incoming.exchange(nullptr);
    delete awaiting_clearance;
    discard_retired();
  }

  void discard_retired() {
    for (Change* change = retired.exchange(nullptr); change != nullptr;)
      delete std::exchange(change, change->next_retired);
  }

  /// Any thread. Null for an empty table.
  void publish_object(const std::string& name, const ObjectModel* model) REQUIRES(world) {
    auto change = std::make_unique<Change>();
    change->replaces_object = true;
    if (model != nullptr) {
      change->object = std::make_unique<PlacedObject>(*model, tip, Simulation::kStepS, plant, config.hold);
    }
    publish(std::move(change));
    object_name = name;
  }

  /// Any thread.
  void publish(std::unique_ptr<Change> change) REQUIRES(world) {
    discard_retired();
    // A change not yet taken up is overtaken; what only it carries moves on into the new one.
    if (const std::unique_ptr<Change> overtaken{incoming.exchange(nullptr)}) {
      if (!change->hand) change->hand = std::move(overtaken->hand);
      if (!change->replaces_object && overtaken->replaces_object) {
        change->replaces_object = true;
        change->object = std::move(overtaken->object);
      }
    }
    incoming.store(change.release(), std::memory_order_release);
  }

  /// True if the object that is to come could be there now: the old one is not touched, and the tip is
  /// neither where the new one's matter will be nor underneath it.
  bool clear_for_object() const noexcept {
    const hal::TruthSample& truth = simulation.truth();
    if (truth.in_contact) return false;
    if (awaiting_clearance->object == nullptr) return true;
    const Projection nearest = project(awaiting_clearance->object->model.shape, truth.tip_position_mm);
    return nearest.depth_mm <= 0.0 && nearest.outward_normal.z > 0.0;
  }

  /// Takes up a change, on the clock's thread. A new hand takes over at once. A new object waits until the
  /// tip is clear of the old one and of where it will be itself; the hand is made to lift off first and
  /// starts its program again afterwards.
  void take_up_change() noexcept {
    if (awaiting_clearance == nullptr) {
      Change* change = incoming.exchange(nullptr, std::memory_order_acq_rel);
      if (change == nullptr) return;
      if (change->hand) {
        std::swap(change->hand, in_place.hand);
        simulation.set_hand(in_place.hand.get());
      }
      if (!change->replaces_object) return retire(change);
      awaiting_clearance = change;
      lifted_for_object = !clear_for_object();
      if (lifted_for_object) simulation.set_hand(&resting_hand);
    }
    if (!clear_for_object()) return;
    std::swap(awaiting_clearance->object, in_place.object);
    simulation.set_object(in_place.object.get());
    if (lifted_for_object) simulation.set_hand(in_place.hand.get());
    retire(std::exchange(awaiting_clearance, nullptr));
  }

  /// True if the tip is clear of an object in place, were it there.
  bool clear_of(const PlacedObject& object) const noexcept {
    const Vector3 seen_mm = object.pose.to_object(simulation.truth().tip_position_mm);
    const Projection nearest = project(object.model.shape, seen_mm);
    return nearest.depth_mm <= 0.0 && nearest.outward_normal.z > 0.0;
  }

  /// Lets what is due by now happen to the object in place; on the clock's thread.
  void let_happen() noexcept {
    ObjectEvent event;
    while (sent.pop(event)) schedule.add(event);
    PlacedObject* object = simulation.object();
    while (schedule.due(1e-9 * static_cast<double>(simulation.time_ns()), event)) {
      if (object == nullptr) continue;
      object->pose.begin(event);
      returning = event.kind == ObjectEvent::Kind::kReturn;
    }
    if (returning && object != nullptr && clear_of(*object)) {
      object->pose.set_present(true);
      returning = false;
    }
  }

  /// Retires what the clock's thread no longer needs, to be freed elsewhere.
  void retire(Change* change) noexcept {
    change->next_retired = retired.load(std::memory_order_relaxed);
    while (!retired.compare_exchange_weak(change->next_retired, change, std::memory_order_acq_rel)) {
    }
  }

  SimulationConfig config;
  Tip tip;
  Plant plant;
  hal::RigInfo info;
  TickClock clock;
  Simulation simulation;
  ExternalInstrument instrument;
  hal::Vector3 instrument_mm;
  SimulatedTracker tracker;

  SerialMutex world;  ///< among callers of set_program and set_object
  std::string object_name GUARDED_BY(world);
  SerialMutex biasing;  ///< among callers of bias_force_sensor
  SensorBias bias;

  // The clock's thread's own.
  Change in_place;                       ///< hand and object in use
  PreparedHand resting_hand;             ///< lifts the tool off
  Change* awaiting_clearance = nullptr;  ///< carries the object that is to come
  bool lifted_for_object = false;
  ObjectSchedule schedule;
  bool returning = false;  ///< a vanished object waits until the tip is clear of it

  ObjectEventQueue sent;  ///< by callers of happen(), one at a time
  std::atomic<Change*> incoming{nullptr};
  std::atomic<Change*> retired{nullptr};
  std::atomic<std::uint64_t> programs_set{0};
  std::atomic<std::uint64_t> program_done{0};  ///< its number; 0: the one in use goes on

  std::uint64_t ticks = 0;
  Clock::time_point started{};
};

SimulatedRig::SimulatedRig(std::unique_ptr<State> state) : state_(std::move(state)) {}
SimulatedRig::~SimulatedRig() = default;

std::vector<std::string> SimulatedRig::device_presets() {
  return device_preset_names();
}
std::vector<std::string> SimulatedRig::object_presets() {
  return object_preset_names();
}
std::vector<std::string> SimulatedRig::tips() {
  return tip_names();
}
std::vector<std::string> SimulatedRig::plants() {
  return plant_names();
}

hal::Result<std::unique_ptr<SimulatedRig>> SimulatedRig::create(const SimulationConfig& config) {
  if (auto error = check_custom(config)) return *error;
  const std::optional<Tip> tip = tip_named(config.tip);
  if (!tip)
    return hal::Error::of(hal::ErrorCode::kUnknownWord, "unknown tip", "[rig.sim] tip", config.tip,
                          hal::joined(tip_names()), "");
  const std::optional<Plant> plant = plant_named(config.plant);
  if (!plant)
    return hal::Error::of(hal::ErrorCode::kUnknownWord, "unknown plant", "[rig.sim] plant", config.plant,
                          hal::joined(plant_names()), "");
  auto model = device_of(config);
  if (!model) return model.error();
  if (auto error = check_structure_and_sensor(config)) return *error;

  auto conditions = conditions_of(config.conditions, config.condition_values);
  if (!conditions) return conditions.error();
  if (config.real_time) conditions->ticks_are_even();  // they are late by themselves
  if (auto error = check(config.hold)) return *error;
  if (config.ticks && config.ticks->empty()) {
    return hal::Error{"a sequence of ticks has none", "simulated rig", "", "at least one", ""};
  }

  auto state = std::make_unique<State>(config, *model, *tip, *plant, *conditions);
  for (const ObjectEvent& event : config.object_events) {
    if (auto error = check(event)) return *error;
    if (!state->schedule.add(event)) {
      return hal::Error{"too many object events", "simulated rig",
                        std::to_string(config.object_events.size()), "at most 64", ""};
    }
  }
  state->info = info_of(config, *model, *plant, *conditions, state->simulation.sensor().info());
  auto rig = std::unique_ptr<SimulatedRig>(new SimulatedRig(std::move(state)));
  if (config.custom_object) {
    const MutexLock lock(rig->state_->world);
    rig->state_->publish_object(config.custom_object->name, &*config.custom_object);
  } else if (auto error = rig->set_object(config.object)) {
    return *error;
  }
  if (auto error = rig->set_program(HandProgram{})) return *error;
  rig->state_->take_up_change();
  return rig;
}

const hal::RigInfo& SimulatedRig::info() const noexcept {
  return state_->info;
}
bool SimulatedRig::owns_clock() const noexcept {
  return !state_->config.real_time;
}

void SimulatedRig::read(hal::RigSample& sample) noexcept {
  State& s = *state_;
  s.take_up_change();
  TickClock::Tick tick;
  std::int64_t& until_ns = tick.time_ns;
  if (s.config.real_time) {
    // The world does not wait for a late caller, but it does not race through more than 0.1 s at once either.
    constexpr std::int64_t kMaxLeapNs = 100'000'000;
    const Clock::time_point now = Clock::now();
    if (s.ticks == 0) s.started = now;
    until_ns = std::chrono::duration_cast<std::chrono::nanoseconds>(now - s.started).count();
    if (until_ns - s.simulation.time_ns() > kMaxLeapNs) {
      s.started += std::chrono::nanoseconds(until_ns - s.simulation.time_ns() - kMaxLeapNs);
      until_ns = s.simulation.time_ns() + kMaxLeapNs;
    }
  } else {
    tick = s.clock.next();
  }
  while (s.simulation.time_ns() + Simulation::kStepNs <= until_ns) {
    s.let_happen();
    s.simulation.step();
  }
  // While a new object waits, another hand lifts the tool off, and the program starts again afterwards.
  const bool is_done = s.awaiting_clearance == nullptr && s.simulation.hand_is_over();
  s.program_done.store(is_done ? s.in_place.hand->number : 0, std::memory_order_relaxed);

  sample = hal::RigSample{};
  // An even clock falls on steps of the physics; any other one says how far beyond the last one it is.
  const std::int64_t beyond_ns =
      s.config.real_time || s.clock.irregular() ? until_ns - s.simulation.time_ns() : 0;
  s.simulation.read_device(sample, beyond_ns);
  s.simulation.sensor().read(sample, {beyond_ns, tick.sensor_late_ns, tick.sensor_lost});
  s.bias.follow(sample, s.simulation.time_ns(), s.simulation.sensor());
  sample.tick = s.ticks++;
  s.tracker.observe(s.simulation.time_ns(), s.simulation.truth().tip_position_mm,
                    s.simulation.true_orientation());
  if (s.config.external_instrument) {
    s.instrument_mm = s.instrument.read(s.simulation.truth().tip_position_mm);
  }
}

void SimulatedRig::write(const hal::DeviceCommand& command) noexcept {
  state_->simulation.command(command.force_n);
}

void SimulatedRig::run(hal::TickHandler& handler, const std::atomic<bool>& stop) noexcept {
  const double speed = state_->config.speed;
  // So long it sleeps at least: shorter sleeps would be longer than they are asked to be.
  constexpr std::chrono::milliseconds kNap{1};
  // A machine that cannot keep up does not catch up later.
  constexpr std::chrono::milliseconds kMaxDebt{20};
  Clock::time_point due = Clock::now();
  const auto period = std::chrono::nanoseconds(
      speed > 0.0 ? std::llround(1e9 / (state_->config.rate_hz * speed)) : std::int64_t{0});
  hal::RigSample sample;
  while (!stop.load(std::memory_order_relaxed)) {
    read(sample);
    write(handler.on_tick(sample));
    if (speed <= 0.0) continue;
    due += period;
    const Clock::time_point now = Clock::now();
    if (due - now >= kNap) std::this_thread::sleep_until(due);
    if (now - due > kMaxDebt) due = now - kMaxDebt;
  }
  write(hal::DeviceCommand{});
}

bool SimulatedRig::truth(hal::TruthSample& truth) const noexcept {
  truth = state_->simulation.truth();
  return true;
}

hal::Quaternion SimulatedRig::true_orientation() const noexcept {
  return state_->simulation.true_orientation();
}
SimulatedTracker& SimulatedRig::tracker() noexcept {
  return state_->tracker;
}

bool SimulatedRig::external_position(hal::Vector3& position_mm) const noexcept {
  if (!state_->config.external_instrument) return false;
  position_mm = state_->instrument_mm;
  return true;
}

std::optional<hal::Error> SimulatedRig::bias_force_sensor() {
  constexpr std::chrono::seconds kTimeout{2};
  const MutexLock lock(state_->biasing);
  if (state_->bias.take(kTimeout)) return std::nullopt;
  return hal::Error{"no bias was taken, and none will be", "simulated force sensor", "2 s",
                    "a quarter of a second", "see whether the loop runs"};
}

std::optional<hal::Error> SimulatedRig::set_program(const HandProgram& program) {
  if (auto error = check(program)) return error;
  const MutexLock lock(state_->world);
  HandProgram normalised = program;
  for (Vector3* direction : {&normalised.stroke_direction, &normalised.shake_direction}) {
    *direction = *direction * (1.0 / length(*direction));
  }
  auto change = std::make_unique<Change>();
  change->hand = std::make_unique<PreparedHand>(state_->simulation.prepare(normalised));
  change->hand->number = state_->programs_set.fetch_add(1, std::memory_order_relaxed) + 1;
  state_->publish(std::move(change));
  return std::nullopt;
}

std::optional<hal::Error> SimulatedRig::set_object(const std::string& name,
                                                   const hal::Vector3& inclusion_aside_mm) {
  std::optional<ObjectModel> model;
  if (name != "none") {
    model = object_preset(name);
    if (!model) {
      return hal::Error::of(hal::ErrorCode::kUnknownWord, "unknown object", "simulated rig", name,
                            hal::joined(object_preset_names()) + ", none", "");
    }
  }
  const Vector3 aside{inclusion_aside_mm.x, inclusion_aside_mm.y, 0.0};
  if (aside.x != 0.0 || aside.y != 0.0) {
    if (!model || !model->phantom || !model->phantom->inclusion) {
      return hal::Error{"this object has no inclusion that could lie aside", "simulated rig", name,
                        "phantom_hard, phantom_soft", ""};
    }
    if (auto error = model->phantom->put_inclusion(aside)) return error;
  }
  const MutexLock lock(state_->world);
  state_->publish_object(name, model ? &*model : nullptr);
  return std::nullopt;
}

std::optional<hal::Error> SimulatedRig::happen(const ObjectEvent& event) {
  if (auto error = check(event)) return error;
  const MutexLock lock(state_->world);
  if (state_->sent.push(event)) return std::nullopt;
  return hal::Error{"too many object events are waiting", "simulated rig", "", "a few at a time", ""};
}

bool SimulatedRig::hand_is_done() const noexcept {
  return state_->program_done.load(std::memory_order_relaxed) ==
         state_->programs_set.load(std::memory_order_relaxed);
}

const std::string& SimulatedRig::tip() const noexcept {
  return state_->config.tip;
}
std::string SimulatedRig::object() const {
  const MutexLock lock(state_->world);
  return state_->object_name;
}

}  // namespace hapticd::sim
