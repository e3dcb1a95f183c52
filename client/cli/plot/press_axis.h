#pragma once

#include "hapticd/v1/common.pb.h"

namespace hapticd::cli {

/// Component of a force in the rig's frame along the press axis of the one-dimensional scenes, -z: what
/// pushes down into the object is positive.
inline double into_object(const v1::Vector3& force) {
  return -force.z();
}

}  // namespace hapticd::cli
