#include "server/identification/gate/stroke_passages.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <tuple>

namespace hapticd::identification {

namespace {

StrokeRow merged(const StrokeRow& a, const StrokeRow& b) {
  const double count = a.count + b.count;
  const double share = b.count / count;
  const auto mean = [share](double x, double y) { return x + share * (y - x); };
  return {{mean(a.mean.time_s, b.mean.time_s), mean(a.mean.along_mm, b.mean.along_mm),
           mean(a.mean.height_mm, b.mean.height_mm), mean(a.mean.reaction_along_n, b.mean.reaction_along_n),
           mean(a.mean.reaction_up_n, b.mean.reaction_up_n)},
          count};
}

/// Passages of one sort show much the same: force and speed to a factor of two, long or short.
using Sort = std::tuple<int, int, bool>;
Sort sort_of(const StrokePassage& passage) {
  double force_n = 0.0;
  double count = 0.0;
  for (const StrokeRow& row : passage.rows.rows()) {
    force_n += row.count * std::hypot(row.mean.reaction_along_n, row.mean.reaction_up_n);
    count += row.count;
  }
  const auto& rows = passage.rows.rows();
  const double duration_s = rows.empty() ? 0.0 : rows.back().mean.time_s - rows.front().mean.time_s;
  const auto octave = [](double value) {
    return value > 1e-12 ? static_cast<int>(std::lround(std::log2(value))) : -100;
  };
  return {octave(count > 0.0 ? force_n / count : 0.0),
          octave(duration_s > 0.0 ? passage.path_mm / duration_s : 0.0),
          passage.path_mm > StrokePassages::kSlidingPathMm};
}

}  // namespace

void StrokeRows::add(const StrokeRow& row) {
  if (!rows_.empty() && rows_.back().count + row.count <= stride_) {
    rows_.back() = merged(rows_.back(), row);
    return;
  }
  if (rows_.size() == kMax) {
    for (std::size_t i = 0; i < kMax / 2; ++i) rows_[i] = merged(rows_[2 * i], rows_[2 * i + 1]);
    rows_.resize(kMax / 2);
    stride_ *= 2.0;
  }
  rows_.push_back(row);
}

void StrokeRows::add(const StrokeRows& rows) {
  for (const StrokeRow& row : rows.rows_) add(row);
}

void StrokeRows::clear() {
  rows_.clear();
  stride_ = 1.0;
}

StrokePassages::StrokePassages(double resolution_mm) : resolution_mm_(resolution_mm) {}

double StrokePassages::noise_width_mm() const {
  if (resolution_mm_ > 0.0) return 1.5 * resolution_mm_;
  // The mean |second difference| of independent errors of deviation s is 1.95 s.
  return 8.0 / 1.95 * roughness_mm_;
}

void StrokePassages::learn_noise(double along_mm) {
  if (remembered_ == 2 && along_mm != last_mm_[0]) {
    const double second_mm = std::abs(along_mm - 2.0 * last_mm_[0] + last_mm_[1]);
    roughness_count_ = std::min(roughness_count_ + 1.0, 2000.0);
    // The first steps of a motion are rough without noise: they count once there are others.
    roughness_mm_ += (std::min(second_mm, 10.0 * roughness_mm_ + 1e-3) - roughness_mm_) / roughness_count_;
  }
  last_mm_[1] = last_mm_[0];
  last_mm_[0] = along_mm;
  remembered_ = std::min(2, remembered_ + 1);
}

void StrokePassages::add(const StrokePoint& point) {
  if (resolution_mm_ > 0.0) return take(point);
  if (raw_count_ == 2) {
    const double a = raw_[1].along_mm;
    const double b = raw_[0].along_mm;
    const double c = point.along_mm;
    StrokePoint middle = raw_[0];
    middle.along_mm = std::max(std::min(a, b), std::min(std::max(a, b), c));
    learn_noise(middle.along_mm);
    take(middle);
  }
  raw_[1] = raw_[0];
  raw_[0] = point;
  raw_count_ = std::min(2, raw_count_ + 1);
}

void StrokePassages::take(const StrokePoint& point) {
  const StrokeRow row{point, 1.0};
  if (!started_) {
    started_ = true;
    current_ = {};
    current_.begin_mm = point.along_mm;
    pending_.clear();
  }
  if (current_.heading == 0) {
    current_.rows.add(row);
    const double moved_mm = point.along_mm - current_.begin_mm;
    if (std::abs(moved_mm) > noise_width_mm()) {
      current_.heading = moved_mm > 0.0 ? 1 : -1;
      farthest_mm_ = point.along_mm;
    }
    return;
  }
  const double ahead_mm = (point.along_mm - farthest_mm_) * current_.heading;
  if (ahead_mm >= 0.0) {
    current_.rows.add(pending_);
    pending_.clear();
    current_.rows.add(row);
    farthest_mm_ = point.along_mm;
    return;
  }
  pending_.add(row);
  if (ahead_mm >= -noise_width_mm()) return;
  // A turn; what came since the tip was farthest belongs to the way back.
  const int heading = -current_.heading;
  const double turned_mm = farthest_mm_;
  close();
  current_ = {};
  current_.start = StrokePassage::Start::kFollows;
  current_.heading = heading;
  current_.begin_mm = turned_mm;
  current_.rows.add(pending_);
  pending_.clear();
  farthest_mm_ = point.along_mm;
}

void StrokePassages::close() {
  current_.path_mm = std::abs(farthest_mm_ - current_.begin_mm);
  passages_.push_back(std::move(current_));
  ++completed_;
  make_room();
}

void StrokePassages::interrupt() {
  if (started_ && current_.heading != 0) {
    const double path_mm = std::abs(farthest_mm_ - current_.begin_mm);
    // A short one with an unknown beginning says nothing: a tap, a slip.
    if (current_.start != StrokePassage::Start::kUnknown || path_mm > kSlidingPathMm) {
      current_.rows.add(pending_);
      close();
    }
  }
  started_ = false;
  pending_.clear();
  current_ = {};
  remembered_ = 0;
  raw_count_ = 0;
}

void StrokePassages::make_room() {
  if (passages_.size() <= kMax) return;
  std::map<Sort, int> many;
  std::vector<Sort> sorts;
  for (const StrokePassage& passage : passages_) {
    sorts.push_back(sort_of(passage));
    ++many[sorts.back()];
  }
  const auto most = std::max_element(many.begin(), many.end(),
                                     [](const auto& a, const auto& b) { return a.second < b.second; });
  const auto at = std::find(sorts.begin(), sorts.end(), most->first) - sorts.begin();
  const auto dropped = passages_.begin() + at;
  const auto next = dropped + 1;
  StrokePassage* follower = next != passages_.end() ? &*next : nullptr;
  if (follower != nullptr && follower->start == StrokePassage::Start::kFollows) {
    follower->start =
        dropped->path_mm > kSlidingPathMm ? StrokePassage::Start::kSaturated : StrokePassage::Start::kUnknown;
  }
  passages_.erase(dropped);
  ++given_up_;
}

std::vector<StrokePassage> StrokePassages::all() const {
  std::vector<StrokePassage> passages(passages_.begin(), passages_.end());
  if (started_ && current_.heading != 0) {
    passages.push_back(current_);
    passages.back().rows.add(pending_);
    passages.back().path_mm = std::abs(farthest_mm_ - current_.begin_mm);
  }
  return passages;
}

}  // namespace hapticd::identification
