#pragma once

#include <array>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "hal/samples.h"
#include "rt/friction/friction_model.h"
#include "rt/friction/tip.h"
#include "rt/inclusion/inclusion_parameters.h"
#include "rt/model/models.h"
#include "rt/model/structural_model.h"

namespace hapticd::rt {

/// Contact dynamics of an object; at least one of the laws.
struct ContactModel {
  std::optional<IdentifiedLaw<HuntCrossleyParameters>> hunt_crossley;
  std::optional<IdentifiedLaw<CreepParameters>> creep;
};

/// Friction between one tip and an object. kRod: Dahl (4.12)-(4.15) or Maxwell-slip; kBallBearing:
/// Coulomb-viscous (4.11).
struct FrictionModel {
  Tip tip = Tip::kRod;
  FrictionParameters friction;
};

/// What hangs on the sensor and how the sensor sits in the tool. A load l in the sensor's frame is
/// rotation · (raw - bias) in the tool's.
struct ToolModel {
  double mass_g = 0.0;            ///< beyond the sensor
  hal::Vector3 centre_mm;         ///< of that mass from the sensor's origin, tool frame
  hal::Vector3 force_bias_n;      ///< sensor frame
  hal::Vector3 torque_bias_n_mm;  ///< sensor frame
  hal::Quaternion sensor_to_tool;
  /// Identity of the sensor's zero that force_bias_n and torque_bias_n_mm were found under; none = unknown.
  /// Under any other zero they mean nothing.
  std::optional<std::string> found_under_bias{};
  /// Centre of that mass from the tip, tool frame; none if the tool was not turned enough to determine it.
  std::optional<hal::Vector3> tip_to_centre_mm{};
};

/// ε_f of a rig with its tool: no false alarm in free motion (D§3.2.2).
struct ThresholdModel {
  double threshold_n = 0.0;
  double largest_residual_n = 0.0;  ///< seen in free motion
  double observed_s = 0.0;
};

/// Controller gains found at the ultimate gain (D§3.3.2).
struct GainsModel {
  double proportional_gain = 0.0;
  double derivative_ms = 0.0;
  double ultimate_gain = 0.0;
  double ultimate_period_ms = 0.0;
};

/// What a stiff sphere in an object adds to the object's force, and where it is (D§5.3). Rig frame.
struct InclusionModel {
  hal::Vector3 place_mm;            ///< p_t, of its centre without load
  hal::Vector3 surface_mm;          ///< p_ts, the nearest point of the surface without load
  HuntCrossleyParameters response;  ///< H_t (5.3)
  double attenuation = 6.0;         ///< how it falls off, see InclusionParameters
  double approach = 0.5;

  /// Parameters as scenes render them; what was not identified keeps its default.
  InclusionParameters rendered(double max_displacement_mm) const {
    InclusionParameters inclusion;
    inclusion.place_mm = place_mm;
    inclusion.surface_mm = surface_mm;
    inclusion.response = response;
    inclusion.max_displacement_mm = max_displacement_mm;
    inclusion.attenuation = attenuation;
    inclusion.approach = approach;
    return inclusion;
  }
};

/// One number of a model with what is known of its error.
struct EstimatedParameter {
  std::string name;  ///< as in model files, e.g. "exponent"
  std::string unit;  ///< "1" for pure numbers
  double value = 0.0;
  double standard_error = 0.0;  ///< one sigma; infinite while the data do not determine it
};

/// Range in which a model may be trusted; zeros = not applicable.
struct ValidityRange {
  double max_displacement_mm = 0.0;
  double max_speed_mm_per_s = 0.0;
  double max_force_n = 0.0;
};

using ModelContent = std::variant<ContactModel, FrictionModel, StructuralModel, ToolModel, ThresholdModel,
                                  GainsModel, InclusionModel>;

/// The result of one identification: what was found, how sure it is, and on what.
struct IdentifiedModel {
  ModelContent content;
  std::string object;          ///< what was touched; empty for models of the rig alone
  std::string device;          ///< DeviceInfo::model; empty if a recording does not show
  std::string sensor;          ///< SensorInfo::model
  std::string procedure;       ///< how, in words
  std::string data_reference;  ///< what it was fitted to: a recording's name and hash, or the session's
  std::vector<EstimatedParameter> parameters;
  ValidityRange validity;
  double residual = 0.0;   ///< rms of what the model leaves over rms of what it explains
  bool converged = false;  ///< false: partial data, kept for what they are worth
};

/// "contact", "friction", "structural_stiffness", "tool", "threshold", "gains" or "inclusion".
const char* kind_name(const ModelContent& content) noexcept;

/// Friction of a FrictionModel as scenes render it: with the relative error of its presliding distance, as
/// its parameters list it, at most 10.
FrictionParameters rendered_friction(const IdentifiedModel& model);

/// True if it is of an object, and not of the rig.
bool is_of_object(const ModelContent& content) noexcept;

/// Checks that all is finite and inside the range it is made for; the error names the key and the limit.
std::optional<hal::Error> check(const IdentifiedModel& model);

}  // namespace hapticd::rt
