#include <algorithm>
#include <cmath>
#include <limits>

#include "server/identification/session/friction_identification.h"
#include "server/identification/session/friction_plan.h"

namespace hapticd::identification {

namespace {

constexpr double kTapSpacingMm = 2.5;
constexpr double kTapMmPerS = 40.0;
constexpr double kStrokePeakMmPerS = 110.0;
constexpr double kCalmPeakMmPerS = 60.0;  // turns of the rod show presliding best when nothing bends
constexpr double kForceRateNPerS = 6.0;
// Strokes overshoot, a tip deep in a curved object is nearest to places farther out, and a profile is known
// worst at its ends.
constexpr double kScanBeyondMm = 8.0;

}  // namespace

void FrictionIdentification::count_coverage(const hal::Vector3& reaction_n, double speed_mm_per_s) {
  if (!(speed_mm_per_s > kSlidingStrokeMmPerS)) return;
  const double force_n = task_.normal_force_n > 0.0 && replay_ ? task_.normal_force_n : reaction_n.z;
  max_force_n_ = std::max(max_force_n_, force_n);
  max_speed_mm_per_s_ = std::max(max_speed_mm_per_s_, speed_mm_per_s);
  const double column = speed_mm_per_s / kMaxSpeedMmPerS * kSpeedBins;
  const double row = force_n / kMaxForceN * kForceBins;
  if (!(column < kSpeedBins && row >= 0.0 && row < kForceBins)) return;
  std::uint32_t& count =
      counts_[static_cast<std::size_t>(static_cast<int>(row) * kSpeedBins + static_cast<int>(column))];
  if (count < std::numeric_limits<std::uint32_t>::max()) ++count;
}

Coverage FrictionIdentification::conditions() const {
  Coverage coverage({"sliding speed", "mm/s", 0.0, kMaxSpeedMmPerS, kSpeedBins},
                    {"normal force", "N", 0.0, kMaxForceN, kForceBins});
  coverage.counts = counts_;
  for (std::size_t i = 0; i < counts_.size() && !replay_; ++i) {  // a recording can be asked for nothing
    coverage.required[i] = asks_for_row(static_cast<int>(i) / kSpeedBins) ? 1 : 0;
  }
  coverage.enough_samples = kEnoughPerCell;
  coverage.update_share();
  return coverage;
}

/// True if a row is asked for: not if all of it is more than the tip slides under, or than the sensor bears.
bool FrictionIdentification::asks_for_row(int row) const {
  return row == 0 || effort_.limit_n() >= row * kMaxForceN / kForceBins;
}

int FrictionIdentification::lacking_force_row() const {
  if (replay_) return -1;
  for (std::size_t i = 0; i < counts_.size(); ++i) {
    if (asks_for_row(static_cast<int>(i) / kSpeedBins) && counts_[i] < kEnoughPerCell)
      return static_cast<int>(i) / kSpeedBins;
  }
  return -1;
}

int FrictionIdentification::scan_taps() const {
  return std::clamp(
      static_cast<int>(std::lround((task_.length_mm + 2.0 * kScanBeyondMm) / kTapSpacingMm)) + 1, 7, 61);
}

bool FrictionIdentification::scanned() const {
  // A tap now and then may fail; the spline bridges one.
  const double half_mm = 0.5 * task_.length_mm + kScanBeyondMm;
  const double widest_mm = 2.5 * 2.0 * half_mm / (scan_taps() - 1);
  double last_mm = -half_mm;
  for (const ProfilePoint& touch : scan_.touches()) {
    if (touch.along_mm - last_mm > widest_mm) return false;
    last_mm = std::max(last_mm, touch.along_mm);
    if (last_mm > half_mm) break;
  }
  return half_mm - last_mm < widest_mm && scan_.touches().size() >= static_cast<std::size_t>(scan_taps()) / 2;
}

MotionRequest FrictionIdentification::next_request() const {
  MotionRequest request;
  if (replay_) return request;
  request.place_mm.x = -0.5 * task_.length_mm;
  request.length_mm = task_.length_mm;
  if (!scanned()) {
    request.motion = MotionRequest::Motion::kLightTaps;
    request.repetitions = scan_taps();
    request.place_mm.x -= kScanBeyondMm;
    request.length_mm += 2.0 * kScanBeyondMm;
    request.speed_mm_per_s = kTapMmPerS;
    request.words = "touch lightly at " + std::to_string(request.repetitions) + " places along a line of " +
                    std::to_string(std::lround(request.length_mm)) + " mm, to scan the surface";
    return request;
  }
  refit();
  const int row = lacking_force_row();
  if (row < 0 && fitted_ && certain(*fitted_) && change_ < kSteady) return request;
  // Calm strokes come first, and again when all is covered but not known well enough.
  constexpr std::uint64_t kCalmPassages = 3;
  const bool calm = task_.tip == rt::Tip::kRod && (passages_.completed() < kCalmPassages || row < 0);
  const int force = passages_.completed() < kCalmPassages ? kForceBins / 2
                    : row < 0 ? static_cast<int>(passages_.completed() % kForceBins)
                              : row;
  request.motion = MotionRequest::Motion::kStroke;
  request.force_n = effort_.asked_n(kStrokeForceN[force], kStrokeForceN[0]);
  request.force_rate_n_per_s = kForceRateNPerS;
  request.speed_mm_per_s = calm ? kCalmPeakMmPerS : kStrokePeakMmPerS;
  request.repetitions = 2;
  request.words = "stroke back and forth along the line, pressing with about " + in_newton(request.force_n) +
                  ", up to " + std::to_string(std::lround(request.speed_mm_per_s)) + " mm/s";
  return request;
}

}  // namespace hapticd::identification
