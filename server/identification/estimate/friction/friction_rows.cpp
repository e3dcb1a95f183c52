#include "server/identification/estimate/friction/friction_rows.h"

#include <algorithm>
#include <cmath>

#include "rt/signal/vector.h"
#include "server/identification/estimate/contact/surface_scan.h"
#include "server/identification/estimate/friction/friction_normals.h"

namespace hapticd::identification {

namespace {

constexpr hal::Vector3 kAlong{1.0, 0.0, 0.0};
constexpr hal::Vector3 kUp{0.0, 0.0, 1.0};

/// Direction at each row of a passage along the line. Noise of the position does not count as a way back.
std::vector<double> directions_of(const StrokePassage& passage) {
  std::vector<double> ways;
  double path_mm = 0.0;
  for (const StrokeRow& row : passage.rows.rows()) {
    path_mm = std::max(path_mm, (row.mean.along_mm - passage.begin_mm) * passage.heading);
    ways.push_back(path_mm);
  }
  return ways;
}

MeanDirectionNormals normals_of(const std::vector<StrokePassage>& passages) {
  MeanDirectionNormals normals;
  for (const StrokePassage& passage : passages) {
    const std::vector<double> ways = directions_of(passage);
    const auto& rows = passage.rows.rows();
    for (std::size_t i = 0; i < rows.size(); ++i) {
      if (ways[i] < StrokePassages::kSlidingPathMm) continue;
      const StrokePoint& p = rows[i].mean;
      normals.add(p.along_mm, passage.heading, {p.reaction_along_n, 0.0, p.reaction_up_n});
    }
  }
  normals.settle();
  return normals;
}

}  // namespace

FrictionRows friction_rows(const std::vector<StrokePassage>& passages, NormalSource source,
                           const SurfaceSpline* surface, double constant_normal_n, double unseen_turn_mm) {
  FrictionRows result;
  MeanDirectionNormals mean;
  if (source != NormalSource::kFlat) mean = normals_of(passages);
  double total = 0.0;
  double by_scan = 0.0;
  double outside = 0.0;
  bool first = true;
  bool known = false;  // is the state of the passage before
  double last_path_mm = 0.0;
  bool last_followed = false;
  for (std::size_t k = 0; k < passages.size(); ++k) {
    const StrokePassage& passage = passages[k];
    if (passage.heading == 0) continue;
    const bool follows = passage.start == StrokePassage::Start::kFollows;
    if (follows) {
      known = known || last_followed || last_path_mm >= StrokePassages::kSlidingPathMm;
    } else {
      known = passage.start == StrokePassage::Start::kSaturated;
    }
    last_followed = follows;
    last_path_mm = passage.path_mm;
    FrictionRow::State before = FrictionRow::State::kGoesOn;
    if (!follows) {
      before = !known                ? FrictionRow::State::kNothing
               : passage.heading > 0 ? FrictionRow::State::kBackwards
                                     : FrictionRow::State::kForwards;
    }

    const std::vector<double> ways = directions_of(passage);
    const auto& rows = passage.rows.rows();
    double path_mm = 0.0;
    double slide_mm = 0.0;
    const bool begins_with_turn = passage.start != StrokePassage::Start::kUnknown;
    for (std::size_t i = 0; i < rows.size(); ++i) {
      const StrokePoint& p = rows[i].mean;
      hal::Vector3 normal = kUp;
      bool has_normal = source == NormalSource::kFlat;
      if (source == NormalSource::kScan && surface != nullptr) {
        if (const auto scanned = normal_at(*surface, {p.along_mm, 0.0, p.height_mm})) {
          normal = scanned->direction;
          has_normal = true;
          by_scan += rows[i].count;
        }
      }
      if (!has_normal && !mean.empty()) has_normal = mean.at(p.along_mm, normal);
      total += rows[i].count;
      const hal::Vector3 tangent = rt::direction_or(rt::across(kAlong, normal), kAlong);
      const double per_along = 1.0 / std::max(0.2, dot(tangent, kAlong));
      const double before_mm = i > 0 ? ways[i - 1] : begins_with_turn ? -unseen_turn_mm : 0.0;
      const double step_mm = (ways[i] - before_mm) * per_along;
      path_mm += step_mm;
      slide_mm += step_mm * passage.heading;
      if (!has_normal) {  // its way counts all the same
        outside += rows[i].count;
        continue;
      }
      const StrokePoint& a = rows[i > 0 ? i - 1 : 0].mean;
      const StrokePoint& b = rows[std::min(i + 1, rows.size() - 1)].mean;
      const double span_s = b.time_s - a.time_s;
      const hal::Vector3 reaction{p.reaction_along_n, 0.0, p.reaction_up_n};
      FrictionRow row;
      row.before = before;
      before = FrictionRow::State::kGoesOn;
      row.slide_mm = slide_mm;
      slide_mm = 0.0;
      row.path_mm = path_mm;
      row.speed_mm_per_s = span_s > 0.0 ? (b.along_mm - a.along_mm) / span_s * per_along : 0.0;
      row.normal_n = constant_normal_n > 0.0 ? constant_normal_n : dot(reaction, normal);
      row.friction_n = -dot(reaction, tangent);
      row.along_mm = p.along_mm;
      row.weight = rows[i].count;
      row.passage = static_cast<int>(k);
      row.heading = passage.heading;
      row.settled = known || path_mm >= StrokePassages::kSlidingPathMm;
      result.min_normal_n = first ? row.normal_n : std::min(result.min_normal_n, row.normal_n);
      result.max_normal_n = first ? row.normal_n : std::max(result.max_normal_n, row.normal_n);
      first = false;
      result.most_speed_mm_per_s = std::max(result.most_speed_mm_per_s, std::abs(row.speed_mm_per_s));
      result.max_path_mm = std::max(result.max_path_mm, path_mm);
      result.rows.push_back(row);
    }
  }
  if (total > 0.0) {
    result.share_by_scan = by_scan / total;
    result.outside_share = outside / total;
  }
  return result;
}

}  // namespace hapticd::identification
