#include "server/identification/estimate/friction/friction_normals.h"

#include <cmath>

#include "rt/signal/vector.h"

namespace hapticd::identification {

namespace {
constexpr double kBinMm = 2.0;
constexpr double kBeyondMm = 4.0;  // distance over which the last known normals are continued, to where
                                   // strokes turn
constexpr int kMinPerDirection = 5;
}  // namespace

void MeanDirectionNormals::add(double along_mm, double heading, const hal::Vector3& reaction_n) {
  Bin& bin = bins_[std::lround(along_mm / kBinMm)];
  const int side = heading > 0.0 ? 0 : 1;
  bin.sum[side] = bin.sum[side] + rt::direction_or(reaction_n, {});
  ++bin.count[side];
}

void MeanDirectionNormals::settle() {
  normals_.clear();
  for (const auto& [place, bin] : bins_) {
    if (bin.count[0] < kMinPerDirection || bin.count[1] < kMinPerDirection) continue;
    normals_[place] = rt::direction_or(rt::direction_or(bin.sum[0], {}) + rt::direction_or(bin.sum[1], {}),
                                       {0.0, 0.0, 1.0});
  }
}

bool MeanDirectionNormals::at(double along_mm, hal::Vector3& normal) const {
  const double place = along_mm / kBinMm;
  auto after = normals_.upper_bound(static_cast<long>(std::floor(place)));
  if (after == normals_.begin()) ++after;
  if (after == normals_.end()) --after;
  const auto before = std::prev(after);
  const double from = static_cast<double>(before->first);
  const double to = static_cast<double>(after->first);
  if (place < from - kBeyondMm / kBinMm || place > to + kBeyondMm / kBinMm) return false;
  const double share = (place - from) / (to - from);
  normal = rt::direction_or(before->second * (1.0 - share) + after->second * share, before->second);
  return true;
}

}  // namespace hapticd::identification
