#pragma once

#include <optional>

namespace hapticd::rt {

/// What is added to the desired force so that the hand gets it while it moves, too, and not only at rest.
/// Each is left out if it is off, and none acts beyond the authority of a contact.
struct CompensationParameters {
  double lead_ms = 3.0;  ///< kExplore only: the displacement is predicted at least so far ahead
  /// Share of the loop's own delay (reaction_delay_s()) by which the reaction is predicted (ReactionLead),
  /// and in one dimension the displacement with it; if a scene explores, the displacement by all of the delay
  /// or lead_ms, whichever is more; 0 = not, 1 takes out all the damping that the delay puts in. None = 0.9:
  /// less than all, so that a delay that is known too long gives no damping below none.
  std::optional<double> reaction_lead_share{};
  bool back_drive = true;  ///< of the device's own dry friction (BackDriveCompensation)
};

}  // namespace hapticd::rt
