#pragma once

#include <optional>

namespace hapticd::rt {

/// What is added to the desired force so that the hand gets it while it moves, too, and not only at rest.
/// Each is left out where it is off, and none acts beyond the authority of a contact.
struct CompensationParameters {
  double lead_ms = 3.0;  ///< kExplore only: the displacement is predicted so far ahead; 0 = not
  /// Share of the loop's own delay (reaction_delay_s()) by which the reaction is predicted (ReactionLead);
  /// 0 = not, 1 takes out all the damping that the delay puts in. None = of the scene's kind: 0.9 in one
  /// dimension; 0 where it explores, for on a displacement that is led already it narrows what is stable, and
  /// a bare weight bounces at targets that are granted.
  std::optional<double> reaction_lead_share{};
  bool back_drive = true;  ///< of the device's own dry friction (BackDriveCompensation)
};

}  // namespace hapticd::rt
