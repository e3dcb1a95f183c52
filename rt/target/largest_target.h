#pragma once

#include <string_view>

#include "hal/rig.h"

namespace hapticd::rt {

/// Down to which displacement the greatest stiffness of a law that is not linear is looked for.
inline constexpr double kMaxTargetDepthMm = 20.0;

/// A firm press of the hand, at which an object's stiffness and what is feasible on it are judged.
inline constexpr double kFirmPressN = 4.0;

/// Largest target stiffness that is granted if a scene does not say. Below the least target that became
/// unstable in simulation with default gains on any of the devices' presets: a hand's press on objects of
/// 0.05 … 5 N/mm with knocks, in one dimension and exploring, and a light press (1 and 2 N) while the target
/// swings between it and 0.3 N/mm, with something to spare for what is uncertain of a device (mode,
/// amplifier, friction); `hapticd_study report --only maps sensitivity` draws the first two. What can be
/// compensated of the structure (kMaxCompensableRatio) is more than what stays stable.
inline constexpr double kMaxTargetNPerMm = 1.0;

/// Lowest structural mode with which a target up to kMaxTargetNPerMm stays still at once. On softer or
/// heavier structures (PHANToM 1.0 at 70 … 85 Hz) objects of 1 … 2.3 N/mm swung from 0.8 N/mm on, before
/// SwingResponse took the compensations: `hapticd_study stability`.
inline constexpr double kStillModeHz = 90.0;
inline constexpr double kMaxTargetOnUnknownModeNPerMm = 0.7;

/// Largest target that a device holds: less if its mode is low or not known (0). A device taken as rigid has
/// none, and the High Force model was still at every mode from 60 Hz on.
inline double largest_target_n_per_mm(const hal::DeviceInfo& device) noexcept {
  const bool is_still = !(device.structural_stiffness_n_per_mm > 0.0) ||
                        device.model.ends_with("1_5_high_force") || device.structural_mode_hz >= kStillModeHz;
  return is_still ? kMaxTargetNPerMm : kMaxTargetOnUnknownModeNPerMm;
}

/// Maximum ratio of a target to the object's own stiffness at 4 N while exploring: strokes over the objects
/// of D§4 went unstable from 4.6 to 10 times on (`hapticd_study explore --only stability`), the softest of
/// them first.
inline constexpr double kMaxTargetOverObject = 4.0;

/// Largest virtual wall, with nothing real behind it: below the stiffest that a hand pressing 4 N with
/// knocks left stable in simulation (2.0 and 6.8 N/mm, D§3.3.2: about 1.3 and 8);
/// `hapticd_study rig --only stability`.
constexpr double default_largest_wall_n_per_mm(std::string_view device_model) noexcept {
  return device_model.ends_with("1_5_high_force") ? 5.0 : 1.3;
}

}  // namespace hapticd::rt
