#pragma once

#include <optional>
#include <string>
#include <vector>

#include "hapticd/v1/identification.pb.h"

namespace hapticd::cli {

/// What the command line says of an identification; each kind uses its own part.
struct IdentifyTask {
  std::string object;
  std::optional<double> time_limit_s;
  bool adopt = false;

  // contact, friction, and structural stiffness from a recording
  std::vector<double> press_direction;  ///< three components, or none
  // contact
  std::string law;     ///< "hunt_crossley", "creep", or empty
  std::string method;  ///< "recursive", "batch", or empty
  std::optional<double> force_n;
  std::optional<double> displacement_mm;
  std::optional<double> speed_mm_per_s;
  // friction
  std::string tip;
  std::optional<double> length_mm;
  std::vector<double> line_direction;  ///< three components, or none
  // structural stiffness
  bool constant = false;
  bool rigid_contact = false;
  std::optional<double> least_object_stiffness_n_per_mm;
  // threshold
  std::optional<double> duration_s;
  // gains
  std::optional<double> target_stiffness_n_per_mm;

  // inclusion
  std::string reference_path;   ///< a recording of the object without it
  std::string reference_model;  ///< or a model of it
  std::optional<double> reach_mm;
  std::optional<double> spacing_mm;
  std::optional<double> known_depth_mm;
  std::optional<double> tip_radius_mm;

  // In the place of the rig
  std::string recording_path;
  std::vector<std::string> columns;  ///< as written: quantity=NAME[:unit[:scale]]
  bool decimal_comma = false;
  std::optional<double> normal_force_n;
};

enum class IdentifyKind { kContact, kFriction, kStructuralStiffness, kTool, kThreshold, kGains, kInclusion };

/// Request to start it; `recording` is filled in by the upload.
v1::StartIdentificationRequest start_request(IdentifyKind kind, const IdentifyTask& task);

/// Description of the recording for the daemon. Throws LocalError naming a --column that is not valid.
v1::RecordingDescription recording_description(const IdentifyTask& task);

}  // namespace hapticd::cli
