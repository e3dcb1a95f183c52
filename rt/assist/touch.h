#pragma once

namespace hapticd::rt {

/// Half of the evidence of an object: what free motion may look like has none.
inline constexpr double kEvidentAuthority = 0.5;

/// What a scene's pipeline knows of its contact, for what acts next to it. All is of the present tick.
struct Touch {
  bool in_contact = false;
  bool is_evident = false;       ///< with at least kEvidentAuthority
  bool is_withdrawn = false;     ///< what was felt is not an object
  double reaction_n = 0.0;       ///< of the object, along its normal; 0 of a virtual one
  double displacement_mm = 0.0;  ///< of the object; 0 out of contact
};

}  // namespace hapticd::rt
