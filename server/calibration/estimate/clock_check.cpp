#include "server/calibration/estimate/clock_check.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <utility>

#include "server/calibration/estimate/median.h"
#include "server/calibration/estimate/poses_refusal.h"
#include "server/calibration/estimate/rigid_fit.h"

namespace hapticd::calibration {

namespace {

using Eigen::Vector3d;

constexpr double kWindowS = 6.0;
constexpr std::size_t kWindowPairs = 120;
constexpr std::size_t kMinWindowPairs = 30;
constexpr double kMaxRigidMm = 15.0;  ///< beyond: no motion of the tool at all
constexpr double kMaxJumpS = 1.5;
constexpr double kCoarseJumpS = 0.08;
constexpr double kFineJumpS = 0.004;

std::vector<MarkerPair> pairs_at(const RigStream& rig, const std::vector<ReferencePose>& reference,
                                 double offset_s) {
  std::vector<MarkerPair> pairs;
  const std::size_t stride = 1 + reference.size() / kWindowPairs;
  for (std::size_t i = 0; i < reference.size(); i += stride) {
    const auto pose = rig.at(reference[i].stamp_s - offset_s);
    if (!pose) continue;
    pairs.push_back({pose->tip_mm, pose->orientation.toRotationMatrix(), reference[i].position_mm});
  }
  return pairs;
}

/// A frame and an offset for one window of the stream.
struct WindowFit {
  RigidFit fit;
  bool mirrored = false;
  double offset_s = 0.0;
};

double median_residual_mm(const WindowFit& window, const std::vector<MarkerPair>& pairs) {
  if (pairs.size() < kMinWindowPairs) return HUGE_VAL;
  std::vector<double> residuals;
  for (const MarkerPair& p : pairs) {
    Vector3d seen = p.seen_mm;
    if (window.mirrored) seen.x() = -seen.x();
    const RigidFit& f = window.fit;
    const Vector3d model = f.scale * (f.transform.rotation * (p.tip_mm + p.tool * f.marker_mm));
    residuals.push_back((seen - model - f.transform.translation_mm).norm() / f.scale);
  }
  return median(std::move(residuals));
}

/// The offset at which a window is most like a rigid motion; speeds alone would say it less well, since the
/// marker moves otherwise than the tip.
std::optional<WindowFit> fit_window(const RigStream& rig, const std::vector<ReferencePose>& window,
                                    const ArmFitSettings& settings) {
  std::optional<WindowFit> best;
  const auto look = [&](double from_s, double to_s, double step_s) {
    for (double offset_s = from_s; offset_s <= to_s; offset_s += step_s) {
      const auto pairs = pairs_at(rig, window, offset_s);
      if (pairs.size() < kMinWindowPairs) continue;
      for (const bool mirrored : {false, true}) {
        const auto fit = fit_rigid(pairs, mirrored, true);
        if (!fit || (best && fit->median_residual_mm >= best->fit.median_residual_mm)) continue;
        best = WindowFit{*fit, mirrored, offset_s};
      }
    }
  };
  look(settings.earliest_s, settings.latest_s, 0.06);
  if (best) look(best->offset_s - 0.04, best->offset_s + 0.04, 0.02);
  return best;
}

}  // namespace

std::optional<hal::Error> check_jump(const RigStream& rig, const std::vector<ReferencePose>& reference,
                                     const ArmFitSettings& settings) {
  std::optional<WindowFit> first_fit;
  std::size_t first = 0;
  for (std::size_t i = 0; i <= reference.size(); ++i) {
    if (i < reference.size() && reference[i].stamp_s - reference[first].stamp_s < kWindowS) continue;
    const std::vector<ReferencePose> window(reference.begin() + static_cast<std::ptrdiff_t>(first),
                                            reference.begin() + static_cast<std::ptrdiff_t>(i));
    if (!first_fit) {
      first_fit = fit_window(rig, window, settings);
      if (!first_fit || first_fit->fit.median_residual_mm > kMaxRigidMm) return std::nullopt;
    } else {
      const auto residual_at = [&](double offset_s) {
        return median_residual_mm(*first_fit, pairs_at(rig, window, offset_s));
      };
      const double usual_mm = residual_at(first_fit->offset_s);
      double best_mm = usual_mm;
      double best_s = 0.0;
      for (double shift_s = -kMaxJumpS; shift_s <= kMaxJumpS; shift_s += 0.02) {
        const double at_mm = residual_at(first_fit->offset_s + shift_s);
        if (at_mm >= best_mm) continue;
        best_mm = at_mm;
        best_s = shift_s;
      }
      if (std::abs(best_s) > kCoarseJumpS && best_mm < 0.4 * usual_mm && std::isfinite(usual_mm)) {
        return poses_refusal(
            "the tracker's clock jumps",
            fmt::format("by {:.0f} ms before {:.1f} s", 1e3 * best_s, reference[i - 1].stamp_s),
            "less than 80 ms", "keep the tracker's clock from being set while it measures");
      }
    }
    if (i == reference.size()) break;
    first = i;
  }
  return std::nullopt;
}

std::optional<hal::Error> check_clock(const ArmFit& fit) {
  std::vector<std::size_t> blocks;
  for (std::size_t i = 0; i < fit.block_offset_s.size(); ++i) {
    if (std::isfinite(fit.block_offset_s[i])) blocks.push_back(i);
  }
  if (blocks.size() < 8) return std::nullopt;
  const auto median_of = [&](std::size_t from, std::size_t to) {
    std::vector<double> v;
    for (std::size_t i = from; i < to; ++i) v.push_back(fit.block_offset_s[blocks[i]]);
    return median(std::move(v));
  };
  const auto spread_of = [&](std::size_t from, std::size_t to, double about) {
    double sum = 0.0;
    for (std::size_t i = from; i < to; ++i) sum += std::abs(fit.block_offset_s[blocks[i]] - about);
    return sum / static_cast<double>(to - from);
  };
  double best_jump = 0.0;
  double best_rest = HUGE_VAL;
  std::size_t best_at = 0;
  for (std::size_t at = 3; at + 3 <= blocks.size(); ++at) {
    const double before = median_of(0, at);
    const double after = median_of(at, blocks.size());
    const double rest = spread_of(0, at, before) * static_cast<double>(at) +
                        spread_of(at, blocks.size(), after) * static_cast<double>(blocks.size() - at);
    if (rest < best_rest) {
      best_rest = rest;
      best_jump = after - before;
      best_at = at;
    }
  }
  best_rest /= static_cast<double>(blocks.size());
  if (std::abs(best_jump) < std::max(kFineJumpS, 5.0 * best_rest)) return std::nullopt;
  return poses_refusal("the tracker's clock jumps or drifts",
                       fmt::format("stamps after {:.1f} s are {:.1f} ms later than before",
                                   fit.block_begin_s[blocks[best_at]], 1e3 * best_jump),
                       "less than 4 ms",
                       "keep the tracker's clock from being set, or say that it is one of its own");
}

}  // namespace hapticd::calibration
