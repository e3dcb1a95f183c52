#pragma once

#include <optional>
#include <string>
#include <vector>

#include "hal/rig.h"
#include "rt/signal/motion_estimator.h"
#include "rt/signal/tool_load.h"
#include "server/identification/estimate/contact/surface_scan.h"
#include "server/identification/estimate/friction/friction_law_choice.h"
#include "server/identification/estimate/friction/friction_law_fit.h"
#include "server/identification/estimate/friction/friction_rows.h"
#include "server/identification/gate/sample_gate.h"
#include "server/identification/gate/stroke_effort.h"
#include "server/identification/gate/stroke_passages.h"
#include "server/identification/session/identification_session.h"
#include "server/identification/session/tasks.h"

namespace hapticd::identification {

/// Friction of a tip on an object (D§4.4.1): first a scan of the surface by light taps along the line, then
/// strokes back and forth along it at several forces up to 110 mm/s. kRod: Dahl's law by divide and conquer;
/// kBallBearing: Coulomb-viscous. See fit_friction_law().
///
/// Normals are the scan's where it reaches, else the mean direction of the reaction back and forth;
/// `procedure` and the remarks say which. Reactions are the sensor's, weight and inertia of the tool
/// subtracted.
///
/// The tip slides unseen while it turns, until the motors' dry friction gives way: that counts as slid, by
/// the friction and the structural stiffness that the device states (unseen_turn_mm()). An exponent above 1
/// is found only if the position is the tip's own, of an instrument (RigInfo::has_external_position).
///
/// A recording (RigKind::kReplay) shows position along x, the friction on the tool as sensor_force_n.x
/// (against the motion, thus negative while x grows) and the normal force as sensor_force_n.z. Its normals
/// are up, unless the height varies and strokes are long enough to determine the mean direction. Its friction
/// channel may have an offset, which is found as well. `normal_force_n` > 0 replaces the normal force;
/// if there is none at all (sensor_force_n.z = 0 throughout) friction is given in newton as
/// `coulomb_force_n`, and the coefficients refer to a nominal normal force of kNominalNormalN.
///
/// finish() chooses the law of a rod by passages held out of the fit (FrictionLawChoice) unless the task says
/// which: Dahl's with exponent 1, with another exponent, or Maxwell-slip elements. What each law leaves of
/// those passages is listed as "held_out_dahl", "held_out_dahl_exponent" and "held_out_maxwell_slip".
///
/// Parameters: "kinetic", "presliding_mm", "viscous_n_s_per_mm"; "exponent", "force_bias_n",
/// "coulomb_force_n" if they were asked for or apply; "maxwell_slip_elements", how many, if that law was
/// chosen. The standard errors of its level and presliding are then those of Dahl's law on the same strokes.
class FrictionIdentification final : public IdentificationSession {
 public:
  static constexpr double kNominalNormalN = 10.0;

  FrictionIdentification(const FrictionTask& task, const hal::RigInfo& rig);

  void add(const rt::Observation& observation) override;
  MotionRequest next_request() const override;

 private:
  struct Fit {
    FrictionLawFit law;
    FrictionRows rows;
    NormalSource source = NormalSource::kFlat;
    FrictionFitOptions options;
    double normal_error_rad = 0.0;  ///< mean standard error of the scan's normals
    bool nominal_normal = false;
  };

  void find(IdentificationProgress& progress) const override;
  std::optional<hal::Error> conclude(const IdentificationProgress& now,
                                     rt::IdentifiedModel& model) const override;
  void count_coverage(const hal::Vector3& reaction_n, double speed_mm_per_s);
  hal::Result<Fit> fit(bool exponent) const;
  /// Fits the same strokes by Maxwell-slip elements; an error if none can be fitted.
  hal::Result<Fit> with_maxwell_slip(Fit dahl) const;
  void refit() const;
  Coverage conditions() const;
  int scan_taps() const;
  bool scanned() const;
  bool asks_for_row(int row) const;
  int lacking_force_row() const;  ///< -1: all covered
  bool certain(const Fit& fit) const;
  std::vector<std::string> missing(bool steady, bool is_certain) const;
  std::vector<rt::EstimatedParameter> parameters_of(const Fit& fit) const;
  std::vector<std::string> remarks(const Fit* fit) const;

  FrictionTask task_;
  hal::RigInfo rig_;
  bool replay_;
  bool sees_tip_;  ///< the position is not the encoders'
  SampleGate gate_;
  SurfaceScan scan_;
  rt::ToolLoad load_;
  rt::ThreeAxisMotion motion_;
  StrokePassages passages_;
  StrokeEffort effort_;
  bool in_contact_ = false;
  bool normal_recorded_ = false;
  double min_height_mm_ = 0.0, max_height_mm_ = 0.0;
  double min_along_mm_ = 0.0, max_along_mm_ = 0.0;
  double begun_s_ = 0.0, last_s_ = 0.0;
  std::uint64_t contact_samples_ = 0;
  std::vector<std::uint32_t> counts_;
  double max_force_n_ = 0.0, max_speed_mm_per_s_ = 0.0;

  // Result that progress() last found; fitting again is not worth it before another passage is complete.
  mutable std::uint64_t fitted_passages_ = 0;
  mutable std::optional<Fit> fitted_;
  mutable std::optional<hal::Error> failed_;
  /// Fit with which the present one is compared.
  struct Reference {
    rt::FrictionParameters parameters;
    std::uint64_t passages = 0;
  };
  mutable std::optional<Reference> reference_;
  mutable double change_ = 1.0;  ///< largest relative change of a parameter over the last few passages
};

}  // namespace hapticd::identification
