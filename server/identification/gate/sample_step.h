#pragma once

namespace hapticd::rt {

/// Two samples farther apart in time than this are not consecutive, at any rate the rig has [s].
inline constexpr double kMaxSampleStepS = 0.016;

}  // namespace hapticd::rt
