#pragma once

#include <map>

#include "hal/samples.h"

namespace hapticd::identification {

/// Normals along a line without a scan of the surface: where the tip passes a place both ways, friction turns
/// its sign and the normal does not, so the mean direction of the reaction is the normal.
class MeanDirectionNormals {
 public:
  /// Adds a reaction while sliding at this place, long after the motion turned. `heading` > 0: along the
  /// line.
  void add(double along_mm, double heading, const hal::Vector3& reaction_n);
  /// Works out the normals of the places that were passed both ways.
  void settle();

  bool empty() const { return normals_.size() < 2; }
  /// Normal between the known places, straight, and up to 4 mm beyond them; false farther away.
  bool at(double along_mm, hal::Vector3& normal) const;

 private:
  struct Bin {
    hal::Vector3 sum[2];
    int count[2] = {0, 0};
  };
  std::map<long, Bin> bins_;
  std::map<long, hal::Vector3> normals_;
};

}  // namespace hapticd::identification
