#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "hal/rig.h"
#include "server/identification/estimate/structural/structural_fit.h"
#include "server/identification/gate/sample_gate.h"
#include "server/identification/session/identification_session.h"
#include "server/identification/session/tasks.h"

namespace hapticd::identification {

/// Structural stiffness of the device from virtual walls pressed at various places while an instrument from
/// outside says where the tip really is (D§4.6.1).
///
/// (4.26) with the sign that a push against the user has: the tip is at p = p_s - c(p) f_d, so that,
/// along each axis that was pressed,
///   p - p_s = o - c(p) f + c F sgn(v) + τ df/dt,
/// with o an offset of each press (the instrument's origin, the device's kinematics), F the dry friction that
/// the motors lose, τ what commands take to act. All are found by linear least squares from sums kept press
/// by press; turns of motion, where friction is anything between -F and F, and impacts are left out. A press
/// that fits four times worse than the others is left out as well and reported.
///
/// Needs Observation::external_position_mm, or a rigid contact (StructuralStiffnessTask::rigid_contact).
/// There the device presses the tip on an object that hardly gives way: p is constant within a press, and the
/// same equation holds with o - p_s on its left. What the object gives way is taken for deflection: with f_r
/// the force on the object and k_o its stiffness
///   c_found = 1/k_s + (f_r/f_d)/k_o,
/// so that 1/c_found is a lower bound of the stiffness. An upper one follows from the least k_o assumed; the
/// distance between the two is part of the standard error.
///
/// A press asks more of the motors than they bear for ever (DeviceInfo::max_continuous_force_n). On hardware
/// their heat is reckoned from the force and the pose, presses are weaker than a simulated device admits, and
/// a rest is requested before a device would warn.
class StructuralIdentification final : public IdentificationSession {
 public:
  StructuralIdentification(const StructuralStiffnessTask& task, const hal::RigInfo& rig);

  void add(const rt::Observation& observation) override;
  MotionRequest next_request() const override;
  hal::Result<rt::IdentifiedModel> finish() const override;

  static constexpr double kAsideMm = 80.0;         ///< presses are requested so far from the home, along x
  static constexpr double kAcrossMm = 50.0;        ///< along y
  static constexpr double kMiddleMm = 70.0;        ///< above it: clear of any object on the table
  static constexpr double kUpDownMm = 40.0;        ///< and so far above and below that
  static constexpr double kStaggerMm = 24.0;       ///< and its height varies by that much
  static constexpr std::size_t kMaxPresses = 128;  ///< kept; later ones take the place of the oldest
  static constexpr std::size_t kRigidPresses = 5;  ///< wanted on a rigid object

 private:
  static constexpr double kEnoughComplianceError = 0.006;  ///< of the compliance at the centre, relative
  static constexpr double kEnoughFieldError = 0.01;
  static constexpr double kEnoughRigidError = 0.01;  ///< what the object hides is of that size anyway
  /// Force on a rigid object below which the two surfaces still settle.
  static constexpr double kSettledN = 0.3;
  static constexpr std::size_t kWindow = 17;   ///< most ticks of a velocity's window
  static constexpr std::size_t kBefore = 150;  ///< free ticks kept from before a press

  /// One tick, centred in the window.
  struct Row {
    hal::Vector3 deflection_mm;  ///< outside minus encoders; rigid contact: outside = 0
    hal::Vector3 force_n;
    double reaction_n = 0.0;  ///< the sensor's; 0 if there is none
    hal::Vector3 force_rate_n_per_s;
    hal::Vector3 velocity_mm_per_s;
    hal::Vector3 place_mm;
  };
  struct Press : StructuralPress {
    double force_n = 0.0;              ///< greatest
    double reaction_n = 0.0;           ///< at the same time
    std::array<FitPoint, 4> points{};  ///< force, deflection against it; model is filled in later
    std::size_t point_count = 0;
    hal::Vector3 points_zero_mm;  ///< deflection before the press; rigid contact: at its beginning
    double points_zero_n = 0.0;   ///< force then
  };
  struct Raw {
    std::int64_t time_ns = 0;
    hal::Vector3 encoder_mm, outside_mm, force_n;
    double reaction_n = 0.0;
  };
  /// What the object's own compliance may hide, rigid contact only.
  struct RigidBounds {
    double reaction_ratio = 1.0;       ///< force on the object over that of the device
    double upper_n_per_mm = HUGE_VAL;  ///< infinite if the assumed object is as soft as what was found
    double relative_error = 0.0;       ///< of the lower bound, as a standard error
  };
  void find(IdentificationProgress& progress) const override;
  std::optional<hal::Error> conclude(const IdentificationProgress& now,
                                     rt::IdentifiedModel& model) const override;
  // structural_presses.cpp
  void warm_up(const rt::Observation& observation) noexcept;
  bool must_cool() const noexcept { return cooling_; }
  void take(const Row& row);
  void accumulate(Press& press, const Row& row) const noexcept;
  void close_press();
  StructuralFit fit(int highest_order) const;
  // structural_requests.cpp
  std::vector<Coverage> places() const;
  MotionRequest press_at(std::size_t target, const char* why) const;
  MotionRequest press_rigid() const;
  bool visited(std::size_t target) const noexcept;
  std::size_t wanted_presses() const noexcept;
  std::size_t pressed_enough() const noexcept;
  /// True if the device's force stays small under press after press, rigid contact only.
  bool gives_way() const noexcept;
  // structural_words.cpp
  std::vector<std::string> missing(const StructuralFit& fit, bool certain, bool steady) const;
  std::vector<std::string> remarks(const StructuralFit& fit) const;
  /// What to press instead of an object that gives way.
  std::string rigid_object() const;
  RigidBounds bounds_of(const rt::StructuralModel& model) const noexcept;
  std::vector<rt::EstimatedParameter> parameters_of(const StructuralFit& fit) const;

  StructuralStiffnessTask task_;
  hal::RigInfo rig_;
  double press_force_n_;
  std::size_t window_ticks_;  ///< odd
  int free_rows_after_;
  SampleGate gate_;
  std::vector<hal::Vector3> targets_mm_;

  std::array<Raw, kWindow> window_{};
  std::size_t window_count_ = 0;
  std::size_t window_next_ = 0;
  std::vector<Row> before_;  ///< ring of free rows
  std::size_t before_next_ = 0;
  std::size_t before_count_ = 0;
  Press press_;
  bool pressing_ = false;
  int free_rows_ = 0;
  int rows_until_point_ = 0;
  double greatest_force_n_ = 0.0;  ///< seen at all
  bool rigid_enough_ = false;      ///< as of the last press: request() is asked while the device renders

  std::vector<Press> presses_;
  std::size_t presses_seen_ = 0;
  std::size_t faint_presses_ = 0;  ///< that said nothing
  std::vector<double> history_;    ///< compliance at the centre after each press

  double heat_ = 0.0;     ///< of the motors, as a share of what they bear; 0 if nothing is known of it
  bool cooling_ = false;  ///< since the last press, until the next one has room
  std::int64_t heated_at_ns_ = 0;

  std::uint64_t rows_used_ = 0;
  std::uint64_t outside_missing_ = 0, jumps_ = 0;
};

}  // namespace hapticd::identification
