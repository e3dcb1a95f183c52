#pragma once

#include <cstddef>
#include <string_view>

#include "rt/scene/scene_spec.h"
#include "server/text/toml_reader.h"

namespace hapticd::server {

inline constexpr std::size_t kMaxModelName = 129;  ///< NAME@TAG

/// The words of scene files, for reading and for writing.
inline constexpr Word<rt::SceneKind> kKinds[] = {
    {"tap_1d", rt::SceneKind::kTap1d}, {"wall", rt::SceneKind::kWall}, {"explore", rt::SceneKind::kExplore}};
inline constexpr Word<rt::Tip> kTips[] = {{"rod", rt::Tip::kRod}, {"ball_bearing", rt::Tip::kBallBearing}};
inline constexpr Word<rt::ContactMethod> kMethods[] = {
    {"matched_inertia", rt::ContactMethod::kMatchedInertia},
    {"filtered_acceleration", rt::ContactMethod::kFilteredAcceleration}};
inline constexpr Word<rt::DirectionMethod> kDirections[] = {{"tracked", rt::DirectionMethod::kTracked},
                                                            {"published", rt::DirectionMethod::kPublished}};
inline constexpr Word<rt::FrictionFeel> kFeels[] = {{"kept", rt::FrictionFeel::kKept},
                                                    {"cancelled", rt::FrictionFeel::kCancelled}};
inline constexpr Word<rt::DisplacementEstimator> kEstimators[] = {
    {"fused", rt::DisplacementEstimator::kFused},
    {"inverse", rt::DisplacementEstimator::kInverse},
    {"recursive", rt::DisplacementEstimator::kRecursive}};
inline constexpr Word<rt::ContactLawKind> kContactLaws[] = {
    {"creep", rt::ContactLawKind::kCreep}, {"hunt_crossley", rt::ContactLawKind::kHuntCrossley}};
inline constexpr Word<rt::ReleaseMethod> kReleases[] = {{"follow", rt::ReleaseMethod::kFollow},
                                                        {"fade", rt::ReleaseMethod::kFade},
                                                        {"cut", rt::ReleaseMethod::kCut}};
inline constexpr Word<rt::TargetLaw::Kind> kTargetLaws[] = {
    {"linear", rt::TargetLaw::Kind::kLinear},
    {"hunt_crossley", rt::TargetLaw::Kind::kHuntCrossley},
    {"displacement_profile", rt::TargetLaw::Kind::kDisplacementProfile},
    {"position_profile", rt::TargetLaw::Kind::kPositionProfile}};
inline constexpr Word<rt::ControlLaw> kLaws[] = {{"closed_loop", rt::ControlLaw::kClosedLoop},
                                                 {"open_loop", rt::ControlLaw::kOpenLoop}};

inline bool explores(const rt::SceneSpec& spec) {
  return spec.kind == rt::SceneKind::kExplore;
}

}  // namespace hapticd::server
