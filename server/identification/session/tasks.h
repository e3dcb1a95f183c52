#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "hal/rig.h"
#include "rt/deformation/hunt_crossley.h"
#include "rt/scene/scene_spec.h"
#include "server/identification/estimate/inclusion/inclusion_fit.h"

namespace hapticd::identification {

/// Tasks: what is to be identified and how far. Each task is carried out by the Identification of its name,
/// which is given the rig's properties next to it. A recording is a rig of kind RigKind::kReplay whose
/// `rate_hz` is one over the median step; nothing can be asked of it, gaps and uneven steps are to be
/// expected, its sensor has no tool mass and its encoders an unknown noise.

enum class ContactFitMethod : std::uint8_t {
  kRecursiveThenBatch,  ///< recursive while it runs, refined by batch in finish()
  kRecursive,           ///< gated single-stage log-linear recursive least squares (D§4.5.1)
  kBatch,               ///< variable projection over all samples kept
};

struct ContactTask {
  std::optional<rt::ContactLawKind> law;  ///< none = all laws
  ContactFitMethod method = ContactFitMethod::kRecursiveThenBatch;
  double force_n = 6.0;          ///< what presses shall reach
  double displacement_mm = 0.0;  ///< coverage required; 0 = what `force_n` gives
  double speed_mm_per_s = 0.0;   ///< coverage required; 0 = by the object's own stiffness
  double threshold_n = 0.02;     ///< ε_f of the contact detection
};

struct FrictionTask {
  rt::Tip tip = rt::Tip::kRod;
  double length_mm = 30.0;  ///< of the line scanned and stroked, along x, centred on the home
  double threshold_n = 0.02;
  double normal_force_n = 0.0;  ///< recordings: the constant normal force if it was not recorded; 0 = it was
  /// Rod: true finds the exponent of Dahl's law, whatever that is worth; false: the law that the data ask
  /// for.
  bool exponent = false;
  bool exponent_is_one = false;  ///< rod: Dahl's law as in D§4.4.1, whatever the data ask for
};

struct StructuralStiffnessTask {
  bool constant = false;  ///< one value for everywhere; false = a field
  /// True without an instrument: the device presses the tip on a rigid object, so that all motion of the
  /// encoders under force is deflection. Always one value, at the object's place.
  bool rigid_contact = false;
  /// Stiffness of a rigid contact: assumed, not measured. The uncertainty does not include what a softer
  /// object would give way.
  double least_object_stiffness_n_per_mm = 1000.0;
};

struct ToolTask {};

struct ThresholdTask {
  double duration_s = 20.0;  ///< of free motion
};

/// Object without its inclusion, as far as it is known: presses on it, or its law. One of them, or none.
struct InclusionReference {
  std::vector<Press> presses;
  std::optional<rt::HuntCrossleyParameters> law;
  std::string words;  ///< "recording 'x.csv'"; empty if there is none

  bool is_there() const noexcept { return law.has_value() || !presses.empty(); }
};

struct InclusionTask {
  double reach_mm = 24.0;         ///< the scan, about the home of the tool
  double spacing_mm = 8.0;        ///< of its places
  double displacement_mm = 13.0;  ///< how deep the presses go
  /// Depth of the inclusion, if that is known: presses straight over it are enough then, and a reference is
  /// needed. 0 = found by a scan.
  double known_depth_mm = 0.0;
  std::optional<double> tip_radius_mm;  ///< of the ball that presses, 0 = a point; none = not known
  double threshold_n = 0.03;
  InclusionReference reference;
};

struct GainsTask {
  double target_stiffness_n_per_mm = 1.0;
};

}  // namespace hapticd::identification
