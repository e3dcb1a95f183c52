#include "hal/sim/simulated_rig.h"

#include <atomic>
#include <chrono>
#include <cmath>
#include <mutex>
#include <numbers>
#include <thread>
#include <utility>

#include "hal/sim/base/range_check.h"
#include "hal/sim/object/general_object_model.h"
#include "hal/sim/sensor/external_instrument.h"
#include "hal/sim/sensor/sensor_bias.h"
#include "hal/sim/simulation.h"
#include "hal/sim/tick_clock.h"

namespace hapticd::sim {

namespace {

using hal::Vector3;
using Clock = std::chrono::steady_clock;

std::string joined(const std::vector<std::string>& names) {
  std::string text;
  for (const std::string& name : names) text += (text.empty() ? "" : ", ") + name;
  return text;
}

double length(const Vector3& v) {
  return std::sqrt(dot(v, v));
}

std::optional<hal::Error> check(const HandProgram& p) {
  struct Range {
    const char* field;
    double value, low, high;
    const char* unit;
  };
  for (const Range& r : {Range{"force_n", p.force_n, 0.0, 30.0, "N"},
                         Range{"depth_mm", p.depth_mm, 0.0, 50.0, "mm"},
                         Range{"force_rate_n_per_s", p.force_rate_n_per_s, 0.01, 100.0, "N/s"},
                         Range{"approach_mm_per_s", p.approach_mm_per_s, 0.1, 500.0, "mm/s"},
                         Range{"speed_mm_per_s", p.speed_mm_per_s, 1.0, 1500.0, "mm/s"},
                         Range{"rate_hz", p.rate_hz, 0.05, 20.0, "Hz"},
                         Range{"hold_s", p.hold_s, -1.0, 3600.0, "s"},
                         Range{"stroke_length_mm", p.stroke_length_mm, 1.0, 150.0, "mm"},
                         Range{"mass_g", p.mass_g, 1.0, 2000.0, "g"},
                         Range{"knock_n", p.knock_n, 0.0, 20.0, "N"},
                         Range{"tap_slant_deg", p.tap_slant_deg, 0.0, 60.0, "°"},
                         Range{"grip_stiffness_scale", p.grip_stiffness_scale, 0.05, 20.0, ""},
                         Range{"grip_damping_scale", p.grip_damping_scale, 0.0, 20.0, ""},
                         Range{"tilt_deg", p.tilt_deg, 0.0, 60.0, "°"},
                         Range{"place_mm.x", p.place_mm.x, -200.0, 200.0, "mm"},
                         Range{"place_mm.y", p.place_mm.y, -150.0, 150.0, "mm"},
                         Range{"place_mm.z", p.place_mm.z, -100.0, 150.0, "mm"},
                         Range{"travel_s", p.travel_s, 0.0, 60.0, "s"},
                         Range{"acceleration_m_per_s2", p.acceleration_m_per_s2, 0.1, 100.0, "m/s²"},
                         Range{"stroke_direction's length", length(p.stroke_direction), 1e-6, 1e6, ""},
                         Range{"shake_direction's length", length(p.shake_direction), 1e-6, 1e6, ""}}) {
    if (auto error = out_of_range(r.field, "hand program", r.value, r.low, r.high, r.unit)) return error;
  }
  if (p.kind == HandProgram::Kind::kScan) {
    return out_of_range("repetitions of a scan", "hand program", p.repetitions, 1.0, 10000.0, "");
  }
  return std::nullopt;
}

/// What a configuration says of structure and sensor beyond the preset.
std::optional<hal::Error> check_extras(const SimulationConfig& config) {
  const auto refuse = [](const char* key, double value, const char* limit) {
    return hal::Error{std::string(key) + " is out of range", "[rig.sim]", std::to_string(value), limit, ""};
  };
  const double gradient = length(config.structural_gradient_per_mm);
  if (!(gradient <= 0.02)) return refuse("structural_gradient_per_mm", gradient, "0 … 0.02 1/mm");
  for (const double h : config.structural_curvature_per_mm2) {
    if (!(std::abs(h) <= 1e-3)) return refuse("structural_curvature_per_mm2", h, "-0.001 … 0.001 1/mm²");
  }
  const double centre = config.tool_centre_mm ? length(*config.tool_centre_mm) : 0.0;
  if (!(centre <= 200.0)) return refuse("tool_centre_mm", centre, "within 200 mm of the sensor");
  const double force = length(config.sensor_force_offset_n);
  if (!(force <= 10.0)) return refuse("sensor_force_offset_n", force, "0 … 10 N");
  const double torque = length(config.sensor_torque_offset_n_mm);
  if (!(torque <= 100.0)) return refuse("sensor_torque_offset_n_mm", torque, "0 … 100 N·mm");
  const hal::Quaternion& q = config.sensor_to_tool;
  const double squared = q.w * q.w + q.x * q.x + q.y * q.y + q.z * q.z;
  if (!(std::abs(squared - 1.0) <= 1e-6)) return refuse("length of sensor_to_tool", std::sqrt(squared), "1");
  return std::nullopt;
}

/// What would divide by nothing, or hang. The presets are beyond doubt.
std::optional<hal::Error> check_custom(const SimulationConfig& config) {
  const auto refuse = [](const std::string& key, double value, const char* limit) {
    return hal::Error{key + " is out of range", "custom device or object of a simulated rig",
                      std::to_string(value), limit, ""};
  };
  constexpr double kMax = HUGE_VAL;
  struct Range {
    const char* key;
    double value, low, high;
    const char* limit;
  };
  std::vector<Range> ranges;
  if (const auto& device = config.custom_device) {
    ranges = {{"max_force_n", device->max_force_n, 0.1, 1e3, "0.1 … 1000 N"},
              {"apparent_mass_kg", device->apparent_mass_kg, 1e-3, 10.0, "0.001 … 10 kg"},
              {"structural_stiffness_n_per_mm", device->structural_stiffness_n_per_mm, 1e-2, 1e4,
               "0.01 … 10000 N/mm"},
              {"structural_damping", device->structural_damping, 0.0, 1.0, "0 … 1"},
              {"coulomb_friction_n", device->coulomb_friction_n, 0.0, 100.0, "0 … 100 N"},
              {"viscous_friction_n_s_per_mm", device->viscous_friction_n_s_per_mm, 0.0, 1.0, "0 … 1 N·s/mm"},
              {"amplifier_pole_hz", device->amplifier_pole_hz, 10.0, 1e5, "10 … 100000 Hz"},
              {"dac_bits", static_cast<double>(device->dac_bits), 4.0, 32.0, "4 … 32"},
              {"encoder_resolution_mm", device->encoder_resolution_mm, 1e-6, 10.0, "1e-6 … 10 mm"},
              {"command_latency_s", device->command_latency_s, 0.0, 1.5e-3, "0 … 0.0015 s"}};
  }
  if (const auto& object = config.custom_object) {
    const MaterialParameters& material = object->material;
    ranges.insert(
        ranges.end(),
        {{"stiffness_at_4n_n_per_mm", material.stiffness_at_4n_n_per_mm, 1e-3, 1e5, "0.001 … 100000 N/mm"},
         {"skin_stiffness_n_per_mm", material.skin_stiffness_n_per_mm, 0.0, kMax, "≥ 0 N/mm"},
         {"skin_viscosity_n_s_per_mm", material.skin_viscosity_n_s_per_mm, 0.0, kMax, "≥ 0 N·s/mm"},
         {"skin_depth_mm", material.skin_depth_mm, 1e-9, kMax, "> 0 mm"}});
    const GeneralMaterialParameters& general = object->general_material;
    const GeneralFrictionParameters& friction = object->general_friction;
    ranges.insert(ranges.end(),
                  {{"fading_share", general.fading_share, 0.0, 1.0, "0 … 1"},
                   {"power", general.power, 1e-3, 0.9, "0.001 … 0.9"},
                   {"strain_growth", general.strain_growth, 0.0, 10.0, "0 … 10"},
                   {"slower_when_dense", general.slower_when_dense, 1.0, 1e3, "1 … 1000"},
                   {"pore_share", general.pore_share, 0.0, 100.0, "0 … 100"},
                   {"pore_time_s", general.pore_time_s, 1e-4, 1e3, "0.0001 … 1000 s"},
                   {"pore_strain_rate_per_s", general.pore_strain_rate_per_s, 1e-6, kMax, "> 0 1/s"},
                   {"load_exponent", friction.load_exponent, 0.5, 1.5, "0.5 … 1.5"},
                   {"stiffness_exponent", friction.stiffness_exponent, 0.0, 1.0, "0 … 1"}});
    for (const SlipShare& slip : general.slips) {
      ranges.push_back({"slip share", slip.share, 0.0, 10.0, "0 … 10"});
      ranges.push_back({"slip limit", slip.limit, 1e-6, 0.5, "0.000001 … 0.5"});
    }
  }
  for (const Range& r : ranges) {
    if (!(r.value >= r.low && r.value <= r.high)) return refuse(r.key, r.value, r.limit);
  }
  return std::nullopt;
}

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

  /// Any thread, `world` held. Null for an empty table.
  void publish_object(const std::string& name, const ObjectModel* model) {
    auto change = std::make_unique<Change>();
    change->replaces_object = true;
    if (model != nullptr) {
      change->object = std::make_unique<PlacedObject>(*model, tip, Simulation::kStepS, plant, config.hold);
    }
    publish(std::move(change));
    object_name = name;
  }

  /// Any thread, `world` held.
  void publish(std::unique_ptr<Change> change) {
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

  /// Whether the object that is to come could be there now: the old one is not touched, and the tip is
  /// neither where the new one's matter will be nor underneath it.
  bool clear_for_object() const noexcept {
    const hal::TruthSample& truth = simulation.truth();
    if (truth.in_contact) return false;
    if (awaiting_clearance->object == nullptr) return true;
    const Projection nearest = project(awaiting_clearance->object->model.shape, truth.tip_position_mm);
    return nearest.depth_mm <= 0.0 && nearest.outward_normal.z > 0.0;
  }

  /// The clock's thread. A new hand takes over at once. A new object waits until the tip is clear of the old
  /// one and of where it will be itself; the hand is made to lift off first and starts its program again
  /// afterwards.
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

  /// Whether the tip is clear of an object in place, were it there.
  bool clear_of(const PlacedObject& object) const noexcept {
    const Vector3 seen_mm = object.pose.to_object(simulation.truth().tip_position_mm);
    const Projection nearest = project(object.model.shape, seen_mm);
    return nearest.depth_mm <= 0.0 && nearest.outward_normal.z > 0.0;
  }

  /// The clock's thread: what is due by now happens to the object in place.
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

  /// What the clock's thread no longer needs goes back to be freed elsewhere.
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

  std::mutex world;  ///< among callers of set_program and set_object
  std::string object_name;
  std::mutex biasing;  ///< among callers of bias_force_sensor
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
  std::optional<DeviceModel> model =
      config.custom_device ? config.custom_device : device_preset(config.device);
  if (!model) {
    return hal::Error{"unknown device", "[rig.sim] device", config.device, joined(device_preset_names()), ""};
  }
  const std::optional<Tip> tip = tip_named(config.tip);
  if (!tip) return hal::Error{"unknown tip", "[rig.sim] tip", config.tip, joined(tip_names()), ""};
  const std::optional<Plant> plant = plant_named(config.plant);
  if (!plant) {
    return hal::Error{"unknown plant", "[rig.sim] plant", config.plant, joined(plant_names()), ""};
  }
  const auto refuse = [](const char* key, double value, const std::string& limit) {
    return hal::Error{std::string(key) + " is out of range", "[rig.sim]", std::to_string(value), limit, ""};
  };
  if (!(config.rate_hz >= 500.0 && config.rate_hz <= 10000.0)) {
    return refuse("rate_hz", config.rate_hz, "500 … 10000 Hz");
  }
  if (!(config.tool_mass_g >= 0.0 && config.tool_mass_g <= 500.0)) {
    return refuse("tool_mass_g", config.tool_mass_g, "0 … 500 g");
  }
  if (config.structural_mode_hz) model->structural_mode_hz = *config.structural_mode_hz;
  if (config.structural_mode_hz || config.custom_device) {
    const double lowest = std::sqrt(4e3 * model->structural_stiffness_n_per_mm / model->apparent_mass_kg) /
                          (2.0 * std::numbers::pi);
    if (!(model->structural_mode_hz >= lowest && model->structural_mode_hz <= 1000.0)) {
      return refuse("structural_mode_hz", model->structural_mode_hz,
                    std::to_string(lowest) + " … 1000 Hz (below, mass and stiffness admit no such mode)");
    }
  }
  if (config.structural_damping) {
    if (!(*config.structural_damping >= 0.0 && *config.structural_damping <= 1.0)) {
      return refuse("structural_damping", *config.structural_damping, "0 … 1");
    }
    model->structural_damping = *config.structural_damping;
  }
  if (config.amplifier_pole_hz) {
    if (!(*config.amplifier_pole_hz >= 10.0 && *config.amplifier_pole_hz <= 1e5)) {
      return refuse("amplifier_pole_hz", *config.amplifier_pole_hz, "10 … 100000 Hz");
    }
    model->amplifier_pole_hz = *config.amplifier_pole_hz;
  }

  model->structural_field = {config.structural_gradient_per_mm, config.structural_curvature_per_mm2};
  if (auto error = check_extras(config)) return *error;

  auto conditions = conditions_of(config.conditions, config.condition_values);
  if (!conditions) return conditions.error();
  if (config.real_time) conditions->ticks_are_even();  // they are late by themselves
  if (auto error = check(config.hold)) return *error;
  if (config.ticks && config.ticks->ticks().empty()) {
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
  state->info.kind = hal::RigKind::kSimulated;
  state->info.name = "sim:" + model->name;
  state->info.rate_hz = config.rate_hz;
  state->info.device = model->info();
  state->info.sensor = state->simulation.sensor().info();
  state->info.sensor.tool_mass_g = config.tool_mass_g;  // as reported; the truth may differ
  state->info.has_truth = true;
  state->info.has_external_position = true;
  state->info.uncertain = model->uncertain();
  for (hal::UncertainParameter& parameter : uncertain_of(*plant)) {
    state->info.uncertain.push_back(std::move(parameter));
  }
  if (config.external_instrument) {
    for (hal::UncertainParameter& parameter : ExternalInstrumentModel{}.uncertain()) {
      state->info.uncertain.push_back(std::move(parameter));
    }
  }
  for (hal::UncertainParameter& parameter : uncertain(*conditions)) {
    state->info.uncertain.push_back(std::move(parameter));
  }
  auto rig = std::unique_ptr<SimulatedRig>(new SimulatedRig(std::move(state)));
  if (config.custom_object) {
    const std::lock_guard lock(rig->state_->world);
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

  sample = hal::RigSample{};
  // An even clock has always rounded to the steps of the physics; one that is not says how late it is.
  const std::int64_t beyond_ns = s.clock.irregular() ? until_ns - s.simulation.time_ns() : 0;
  s.simulation.read_device(sample, beyond_ns);
  s.simulation.sensor().read(sample, {beyond_ns, tick.sensor_late_ns, tick.sensor_lost});
  s.bias.follow(sample, s.simulation.time_ns(), s.simulation.sensor());
  sample.tick = s.ticks++;
  if (s.config.external_instrument) {
    s.instrument_mm = s.instrument.read(s.simulation.truth().tip_position_mm);
  }
}

void SimulatedRig::write(const hal::DeviceCommand& command) noexcept {
  state_->simulation.command(command.force_n);
}

bool SimulatedRig::truth(hal::TruthSample& truth) const noexcept {
  truth = state_->simulation.truth();
  return true;
}

bool SimulatedRig::external_position(hal::Vector3& position_mm) const noexcept {
  if (!state_->config.external_instrument) return false;
  position_mm = state_->instrument_mm;
  return true;
}

std::optional<hal::Error> SimulatedRig::bias_force_sensor() {
  constexpr std::chrono::seconds kTimeout{2};
  constexpr std::chrono::milliseconds kPollInterval{2};
  const std::lock_guard lock(state_->biasing);
  const std::uint32_t number = state_->bias.ask();
  const auto until = Clock::now() + kTimeout;
  while (!state_->bias.taken(number)) {
    if (Clock::now() >= until) {
      return hal::Error{"no bias was taken yet", "simulated force sensor", "2 s", "a quarter of a second",
                        "see whether the loop runs"};
    }
    std::this_thread::sleep_for(kPollInterval);
  }
  return std::nullopt;
}

std::optional<hal::Error> SimulatedRig::set_program(const HandProgram& program) {
  if (auto error = check(program)) return error;
  const std::lock_guard lock(state_->world);
  HandProgram normalised = program;
  for (Vector3* direction : {&normalised.stroke_direction, &normalised.shake_direction}) {
    *direction = *direction * (1.0 / length(*direction));
  }
  auto change = std::make_unique<Change>();
  change->hand = std::make_unique<PreparedHand>(state_->simulation.prepare(normalised));
  state_->publish(std::move(change));
  return std::nullopt;
}

std::optional<hal::Error> SimulatedRig::set_object(const std::string& name) {
  std::optional<ObjectModel> model;
  if (name != "none") {
    model = object_preset(name);
    if (!model) {
      return hal::Error{"unknown object", "simulated rig", name, joined(object_preset_names()) + ", none",
                        ""};
    }
  }
  const std::lock_guard lock(state_->world);
  state_->publish_object(name, model ? &*model : nullptr);
  return std::nullopt;
}

std::optional<hal::Error> SimulatedRig::happen(const ObjectEvent& event) {
  if (auto error = check(event)) return error;
  const std::lock_guard lock(state_->world);
  if (state_->sent.push(event)) return std::nullopt;
  return hal::Error{"too many object events are waiting", "simulated rig", "", "a few at a time", ""};
}

std::string SimulatedRig::object() const {
  const std::lock_guard lock(state_->world);
  return state_->object_name;
}

}  // namespace hapticd::sim
