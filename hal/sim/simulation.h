#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <variant>
#include <vector>

#include "hal/samples.h"
#include "hal/sim/base/conditions.h"
#include "hal/sim/base/plant.h"
#include "hal/sim/device/arm_unevenness.h"
#include "hal/sim/device/axis_dynamics.h"
#include "hal/sim/device/base_vibration.h"
#include "hal/sim/device/delay_line.h"
#include "hal/sim/device/device_model.h"
#include "hal/sim/device/hidden_arm.h"
#include "hal/sim/hand/hand_motion.h"
#include "hal/sim/object/friction.h"
#include "hal/sim/object/material.h"
#include "hal/sim/object/object_events.h"
#include "hal/sim/object/object_model.h"
#include "hal/sim/object/phantom_body.h"
#include "hal/sim/sensor/nano17.h"

namespace hapticd::sim {

/// What a hand program needs, computed before it takes over (matrix exponentials do not belong in a step).
struct PreparedHand {
  std::uint64_t number = 0;  ///< of the program, as its rig counts them
  HandProgram program;
  HandImpedance impedance;
  AxisDynamics across;
  AxisDynamics along;
  /// Dynamics over the field. If the structure's stiffness varies: the same from half the compliance at home
  /// to twice as much, in equal ratios; if the arm's mass varies, that for each of several masses, from the
  /// smallest to the largest. Empty if both are constant.
  std::vector<AxisDynamics> across_field;
  std::vector<AxisDynamics> along_field;
};

/// How the tool hangs on the sensor and the sensor sits in the tool.
struct ToolMounting {
  /// Centre of the tool's mass, from the sensor's origin, tool frame. Without: the mass moves as the tip
  /// does, however the tool turns, and torque is what the whole load would make at the tip.
  std::optional<hal::Vector3> centre_mm{};
  hal::Quaternion sensor_to_tool{};  ///< rotates sensor coordinates into the tool's
  hal::Vector3 force_offset_n{};     ///< sensor frame: what it reads, once biased, besides the load
  hal::Vector3 torque_offset_n_mm{};

  bool plain() const noexcept;  ///< as if there were no mounting
};

/// An object in place: its shape and the state of its matter, by the laws of one family.
struct PlacedObject {
  PlacedObject(const ObjectModel& object, Tip tip, double step_s, Plant plant = Plant::kSeparable,
               const ObjectHold& hold = {})
      : model(object), pose(hold, step_s) {
    if (plant == Plant::kGeneral) {
      material.emplace<GeneralMaterial>(object.material, object.general_material, step_s);
      friction.emplace<MaxwellSlipFriction>(object.friction_with(tip), object.general_friction, step_s);
    } else {
      material.emplace<Material>(object.material, step_s);
      friction.emplace<Friction>(object.friction_with(tip), step_s);
    }
    if (object.phantom) phantom.emplace(*object.phantom, step_s);
  }
  ObjectModel model;
  std::variant<Material, GeneralMaterial> material;
  std::variant<Friction, MaxwellSlipFriction> friction;
  std::optional<PhantomBody> phantom;  ///< in place of `material`
  ObjectPose pose;
};

/// Axis of the device with sensor and tool in a hand whose impedance along it is given.
AxisParameters axis_of(const DeviceModel& device, double tool_mass_kg, double hand_mass_kg,
                       double hand_stiffness_n_per_mm, double hand_damping_n_s_per_mm,
                       double arm_mass_factor = 1.0);

/// The coupled physics, one step of 0.1 ms at a time, unless another step is asked for to see what the step
/// does to a result; the sensor samples once a step. Single-threaded. Device and tool weight are
/// counterbalanced, as on the real device; the sensor feels gravity through the tool all the same.
class Simulation {
 public:
  static constexpr double kStepS = 1e-4;
  static constexpr std::int64_t kStepNs = 100'000;

  /// `step_s`: whole nanoseconds, and an object's matter is to be made for the same.
  Simulation(const DeviceModel& device, double tool_mass_kg, std::uint64_t seed,
             const ToolMounting& mounting = {}, double step_s = kStepS, const Conditions& conditions = {},
             bool sensor_samples_wait = false);

  PreparedHand prepare(const HandProgram& program) const;
  /// Takes over from where the tip is. The objects live as long as the simulation uses them.
  void set_hand(const PreparedHand* hand) noexcept;
  /// HandMotion::is_over() of that hand.
  bool hand_is_over() const noexcept { return motion_ && motion_->is_over(); }
  /// Null for an empty table.
  void set_object(PlacedObject* object) noexcept;
  const PlacedObject* object() const noexcept { return object_; }
  PlacedObject* object() noexcept { return object_; }

  void step() noexcept;

  /// Force asked of the motors; takes effect after the device's latency.
  void command(const hal::Vector3& force_n) noexcept;
  std::int64_t time_ns() const noexcept { return steps_ * step_ns_; }
  const hal::Quaternion& true_orientation() const noexcept { return orientation_; }
  /// Position as the encoders report it and orientation as the gimbal reports it, `beyond_ns` after the last
  /// step: less than a step, in which the tip goes on evenly.
  void read_device(hal::RigSample& sample, std::int64_t beyond_ns = 0) noexcept;
  Nano17& sensor() noexcept { return sensor_; }
  const hal::TruthSample& truth() const noexcept { return truth_; }
  const DeviceModel& device() const noexcept { return device_; }

 private:
  static constexpr double kGravityMmPerS2 = 9807.0;
  static constexpr double kSwayBuildsUpS = 1.0;

  struct Pending {
    std::int64_t due_step = 0;
    hal::Vector3 force_n;
  };

  hal::Vector3 motor_force() noexcept;
  std::array<AxisDynamics, 3> dynamics_at(const hal::Vector3& tip_mm) const noexcept;
  void load_sensor(const hal::Vector3& acceleration_mm_per_s2, double time_s) noexcept;
  void follow_contour(HandIntent& intent) noexcept;
  /// Force of a phantom's matter on the tip, rig frame; `nearest` is of the undeformed surface.
  hal::Vector3 press_phantom(const hal::Vector3& free_mm, double compliance_mm_per_n,
                             const Projection& nearest, Material::Step& step) noexcept;
  void touch(const hal::Vector3& before_mm, std::array<AxisState, 3>& axes,
             const std::array<const AxisDynamics*, 3>& dynamics) noexcept;
  hal::Vector3 tremor(double time_s) const noexcept;
  double hand_time_s() const noexcept { return static_cast<double>(steps_ - hand_began_step_) * step_s_; }
  hal::Vector3 sway(double hand_time_s) const noexcept;
  hal::Quaternion tool_orientation(double time_s) const noexcept;
  double tilt_rad(double time_s) const noexcept;

  DeviceModel device_;
  double tool_mass_kg_;
  ToolMounting mounting_;
  bool plain_mounting_;
  double step_s_;
  std::int64_t step_ns_;
  std::int64_t slow_steps_;  ///< tremor and wobble are slow: once a millisecond will do
  Random random_;
  Conditions conditions_;
  ArmUnevenness unevenness_;
  HiddenArm hidden_arm_;
  BaseVibration vibration_;
  Nano17 sensor_;
  const PreparedHand* hand_ = nullptr;
  std::optional<HandMotion> motion_;
  PlacedObject* object_ = nullptr;

  std::array<AxisState, 3> axes_{};
  std::array<Pending, 16> pending_{};  ///< one for each step of the latency, and some to spare
  std::size_t pending_count_ = 0;
  hal::Vector3 wanted_n_;     ///< command in force, quantised
  hal::Vector3 amplifier_n_;  ///< after the amplifier's lag
  std::array<double, 4> tremor_phase_{};
  hal::Vector3 tremor_mm_;
  hal::Vector3 contour_normal_{0.0, 0.0,
                               1.0};  ///< where the hand means to be; up unless it follows a contour
  std::int64_t steps_ = 0;
  std::int64_t hand_began_step_ = 0;
  hal::Vector3 sway_before_rad_;          ///< when the hand took over
  std::array<MinimumJerk, 3> sway_ends_;  ///< a mounted tool turns on smoothly from there
  hal::Quaternion orientation_;
  std::array<hal::Vector3, 2>
      centre_before_mm_{};  ///< of the tool's mass from the tip, rig frame: last, before
  int centres_known_ = 0;
  bool followed_contour_ = false;
  hal::Vector3 contour_offset_mm_;  ///< between what was meant before and along the contour; fades
  std::int64_t contour_began_step_ = 0;
  /// What the encoders read, step by step; kept if the reading is delayed.
  struct Seen {
    std::array<double, 3> motor_mm{};
    std::array<double, 3> motor_mm_per_s{};
    hal::Quaternion orientation;
  };
  DelayLine<Seen, 64> seen_;
  std::size_t encoder_delay_steps_ = 0;
  hal::TruthSample truth_;
};

}  // namespace hapticd::sim
