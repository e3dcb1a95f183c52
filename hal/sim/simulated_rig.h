#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "hal/error.h"
#include "hal/rig.h"
#include "hal/sim/base/conditions.h"
#include "hal/sim/device/device_model.h"
#include "hal/sim/hand/hand.h"
#include "hal/sim/object/object_events.h"
#include "hal/sim/object/object_model.h"
#include "hal/sim/tick_interval.h"
#include "hal/sim/tracker/simulated_tracker.h"

namespace hapticd::sim {

/// Rig to simulate. Uncertain device parameters may be overridden to see what they do to a result.
struct SimulationConfig {
  std::string device = "phantom_1_0";
  std::string object = "sponge_block";  ///< "none" for an empty table
  std::string tip = "rod";              ///< or "ball_bearing"
  std::string plant = "separable";      ///< or "general": the laws the objects follow, see Plant
  double rate_hz = 1000.0;              ///< of the tick; the physics runs at 10 kHz whatever this is
  std::uint64_t seed = 1;
  /// False: each read() advances exactly one period, however long the caller took (virtual time).
  /// True: read() advances by the wall clock, so a late caller meets a world that moved on without it.
  bool real_time = false;
  double speed =
      0.0;  ///< virtual time only: at most so many seconds of it in a second; 0 = as fast as it goes
  double tool_mass_g = 9.35;                   ///< beyond the sensor (D§3.2.1)
  std::optional<double> structural_mode_hz{};  ///< override of the preset's value
  std::optional<double> structural_damping{};  ///< damping ratio of that mode
  std::optional<double> amplifier_pole_hz{};
  /// A device, an object of one's own in place of the presets named above, for studies: a preset with any of
  /// its parameters changed. Overrides of uncertain parameters apply to it too. set_object() knows presets
  /// only.
  std::optional<DeviceModel> custom_device{};
  std::optional<ObjectModel> custom_object{};
  /// Compliance of the structure over the workspace, see StructuralField; zeros = the same everywhere.
  hal::Vector3 structural_gradient_per_mm{};
  std::array<double, 6> structural_curvature_per_mm2{};
  /// Centre of the tool's mass from the sensor's origin, tool frame (the tip is at z = -60 mm). Without one
  /// the mass moves as the tip does and torque is that of a load at the tip.
  std::optional<hal::Vector3> tool_centre_mm{};
  hal::Vector3 sensor_force_offset_n{};  ///< sensor frame; the rig is biased with its tool upright
  hal::Vector3 sensor_torque_offset_n_mm{};
  hal::Quaternion sensor_to_tool{};  ///< rotates sensor coordinates into the tool's; of length 1
  bool external_instrument = true;   ///< whether external_position() answers
  /// "clean": a perfect clock, sensor and table; "lab": what real life adds, see conditions.h.
  std::string conditions = "clean";
  std::map<std::string, double> condition_values{};  ///< single ones by name, over the preset's
  /// Virtual time only: when the ticks fall and when sensor samples arrive, in place of what the conditions
  /// say.
  std::shared_ptr<const TickIntervals> ticks{};
  ObjectHold hold{};                         ///< of whatever object is in place
  std::vector<ObjectEvent> object_events{};  ///< what happens to it, on the rig's time
};

/// Device, hand, object and sensor as one coupled physical system, seeded and bit-repeatable in virtual time.
/// Shares nothing with rt/: its objects are not Hunt-Crossley laws, its friction is not Dahl's.
class SimulatedRig final : public hal::Rig {
 public:
  static hal::Result<std::unique_ptr<SimulatedRig>> create(const SimulationConfig& config);
  ~SimulatedRig() override;

  static std::vector<std::string> device_presets();
  static std::vector<std::string> object_presets();
  static std::vector<std::string> tips();
  static std::vector<std::string> plants();

  const hal::RigInfo& info() const noexcept override;
  bool owns_clock() const noexcept override;  ///< true in virtual time
  void read(hal::RigSample& sample) noexcept override;
  void write(const hal::DeviceCommand& command) noexcept override;
  void run(hal::TickHandler& handler, const std::atomic<bool>& stop) noexcept override;
  bool truth(hal::TruthSample& truth) const noexcept override;
  bool external_position(hal::Vector3& position_mm) const noexcept override;
  /// Takes the mean of the next quarter of a second as the sensor's zero; waits for it, so another thread has
  /// to read meanwhile.
  std::optional<hal::Error> bias_force_sensor() override;
  /// True orientation of the tool at the last sample; for the clock's thread.
  hal::Quaternion true_orientation() const noexcept;
  /// Watches if the conditions have `tracker_rate_hz`.
  SimulatedTracker& tracker() noexcept;

  /// Sets a program, which is checked here and taken up at the next read(); the motion starts from where the
  /// hand is then. Any thread.
  std::optional<hal::Error> set_program(const HandProgram& program);
  /// Any thread. Whether the program that was set last has come to its end (HandMotion::is_over).
  bool hand_is_done() const noexcept;
  /// Any thread. Puts another object ("none" for none) under the tool; refused by name if unknown. A tip
  /// that touches the old object, or would be inside the new one, is lifted off first; then the program, a
  /// passive weight's too, starts again.
  /// `inclusion_aside_mm`: of a phantom with an inclusion, x and y of the place where it is touched straight
  /// over it; 25 mm from the middle at most.
  std::optional<hal::Error> set_object(const std::string& name, const hal::Vector3& inclusion_aside_mm = {});
  std::string object() const;
  /// "rod" or "ball_bearing".
  const std::string& tip() const noexcept;
  /// Lets something happen to the object in place, at the next read() or later as it says. Refused if too
  /// many are waiting already. Any thread.
  std::optional<hal::Error> happen(const ObjectEvent& event);

 private:
  struct State;
  explicit SimulatedRig(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

}  // namespace hapticd::sim
