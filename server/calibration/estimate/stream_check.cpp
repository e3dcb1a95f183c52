#include "server/calibration/estimate/stream_check.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <utility>

#include "server/calibration/estimate/clock_check.h"
#include "server/calibration/estimate/median.h"
#include "server/calibration/estimate/poses_refusal.h"
#include "server/calibration/estimate/rigid_fit.h"
#include "server/calibration/estimate/stream_offset.h"
#include "server/linear_algebra/linear_algebra.h"

namespace hapticd::calibration {

namespace {

using Eigen::Matrix3d;
using Eigen::Quaterniond;
using Eigen::Vector3d;

constexpr double kFrozenS = 0.5;
constexpr double kMovedMm = 5.0;
constexpr double kMinSpreadMm = 8.0;
constexpr double kMaxScaleError = 0.06;
constexpr double kMinTurnRad = 0.15;

std::optional<hal::Error> check_stamps(const std::vector<ReferencePose>& reference) {
  if (reference.size() < kMinReferencePoses) {
    return poses_refusal("too few poses", std::to_string(reference.size()), "at least 40",
                         "let the tracker run longer");
  }
  for (std::size_t i = 1; i < reference.size(); ++i) {
    const double step_s = reference[i].stamp_s - reference[i - 1].stamp_s;
    if (step_s > -0.02) continue;  // a few milliseconds of jitter may exchange two
    return poses_refusal("the tracker's clock jumps",
                         fmt::format("by {:.0f} ms at {:.2f} s", 1e3 * step_s, reference[i - 1].stamp_s),
                         "stamps that go on", "keep the tracker's clock from being set while it measures");
  }
  return std::nullopt;
}

std::optional<hal::Error> check_frozen(const RigStream& rig, const std::vector<ReferencePose>& reference,
                                       double offset_s) {
  std::size_t first = 0;
  for (std::size_t i = 1; i <= reference.size(); ++i) {
    if (i < reference.size() && reference[i].position_mm == reference[first].position_mm) continue;
    const double held_s = reference[i - 1].stamp_s - reference[first].stamp_s;
    if (held_s > kFrozenS) {
      double moved_mm = 0.0;
      const auto from = rig.at(reference[first].stamp_s - offset_s);
      for (std::size_t k = first; from && k < i; ++k) {
        const auto to = rig.at(reference[k].stamp_s - offset_s);
        if (to) moved_mm = std::max(moved_mm, (to->tip_mm - from->tip_mm).norm());
      }
      if (moved_mm > kMovedMm) {
        return poses_refusal(
            "the tracker is frozen",
            fmt::format("the same pose from {:.2f} s to {:.2f} s while the tip moved by {:.0f} mm",
                        reference[first].stamp_s, reference[i - 1].stamp_s, moved_mm),
            "poses that change", "restart the tracker; send only poses it measured");
      }
    }
    first = i;
  }
  return std::nullopt;
}

std::optional<hal::Error> check_scale(double scale) {
  if (std::abs(scale - 1.0) < kMaxScaleError) return std::nullopt;
  struct Unit {
    const char* name;
    double scale;
  };
  for (const Unit& unit : {Unit{"metres", 1e-3}, Unit{"centimetres", 0.1}, Unit{"inches", 1.0 / 25.4},
                           Unit{"micrometres", 1e3}, Unit{"tenths of a millimetre", 10.0}}) {
    if (std::abs(scale / unit.scale - 1.0) > kMaxScaleError) continue;
    return poses_refusal(fmt::format("the poses are in {}", unit.name),
                         fmt::format("{:.4g} of the device's millimetres", scale), "millimetres",
                         fmt::format("multiply positions by {:.4g}", 1.0 / unit.scale));
  }
  return poses_refusal("the tracker's lengths are not the device's",
                       fmt::format("{:.4g} of a millimetre", scale), "0.94 … 1.06",
                       "see whether the tracker is calibrated and sends millimetres");
}

/// How turns of the tool are seen: their vectors' best orthogonal map, and whether their angles agree.
struct TurnRelation {
  Matrix3d map = Matrix3d::Identity();  ///< det ±1
  double disagreement_rad = 0.0;        ///< median difference of the angles
  double residual = 0.0;                ///< median angle between mapped and seen axes, rad
  std::size_t count = 0;
};

template <class Read>
TurnRelation relate_turns(const RigStream& rig, const std::vector<ReferencePose>& reference, double offset_s,
                          Read&& read) {
  TurnRelation relation;
  std::vector<std::pair<Vector3d, Vector3d>> turns;
  std::vector<double> differences;
  const std::size_t apart = std::max<std::size_t>(5, reference.size() / 100);
  for (std::size_t i = 0; i + apart < reference.size(); i += 3) {
    const auto a = rig.at(reference[i].stamp_s - offset_s);
    const auto b = rig.at(reference[i + apart].stamp_s - offset_s);
    if (!a || !b) continue;
    const Vector3d of_rig = rt::turn_of(b->orientation * a->orientation.conjugate());
    const Vector3d seen = rt::turn_of(read(reference[i + apart]) * read(reference[i]).conjugate());
    if (of_rig.norm() < kMinTurnRad || of_rig.norm() > 2.5) continue;
    turns.emplace_back(of_rig, seen);
    differences.push_back(std::abs(of_rig.norm() - seen.norm()));
  }
  relation.count = turns.size();
  if (turns.size() < 20) return relation;
  relation.disagreement_rad = median(differences);
  std::vector<double> weights(turns.size(), 1.0);
  std::vector<double> angles;
  for (int round = 0; round < 5; ++round) {
    Matrix3d product = Matrix3d::Zero();
    for (std::size_t i = 0; i < turns.size(); ++i) {
      product += weights[i] * turns[i].second.normalized() * turns[i].first.normalized().transpose();
    }
    const linear_algebra::SingularValues3 polar = linear_algebra::singular_values(product);
    relation.map = polar.u * polar.v.transpose();
    angles.clear();
    for (std::size_t i = 0; i < turns.size(); ++i) {
      const double cosine = turns[i].second.normalized().dot(relation.map * turns[i].first.normalized());
      angles.push_back(std::acos(std::clamp(cosine, -1.0, 1.0)));
      weights[i] = 1.0 / (1.0 + std::pow(angles.back() / 0.3, 2));
    }
  }
  relation.residual = median(angles);
  return relation;
}

/// Names a signed permutation near m; empty if there is none.
std::string in_words(const Matrix3d& m) {
  constexpr std::array<const char*, 3> kAxes{"x", "y", "z"};
  std::string words;
  for (int row = 0; row < 3; ++row) {
    Eigen::Index column = 0;
    const double value = m.row(row).cwiseAbs().maxCoeff(&column);
    if (value < 0.9) return {};
    if (column == row && m(row, column) > 0.0) continue;
    words +=
        fmt::format("{}{} is sent as {}", words.empty() ? "" : ", ",
                    std::string(m(row, column) < 0.0 ? "-" : "") + kAxes[static_cast<std::size_t>(column)],
                    kAxes[static_cast<std::size_t>(row)]);
  }
  return words;
}

hal::Error mirrored(const Matrix3d& positions, const std::optional<Matrix3d>& turns) {
  std::string value = "one axis is reversed, or two are swapped";
  std::string remedy = "send positions and orientations of one right-handed frame";
  if (turns && turns->determinant() > 0.0) {
    const Matrix3d between = positions * turns->transpose();
    if ((between + Matrix3d::Identity()).norm() < 0.5) {
      remedy =
          "the orientations are of the same left-handed frame: reverse one axis of positions and "
          "orientations alike";
    } else if (const std::string words = in_words(between); !words.empty()) {
      value = "compared with the orientations, " + words;
      remedy = "send the positions' axes in the order and with the signs of the orientations' frame";
    }
  }
  return poses_refusal("the tracker's frame is left-handed", std::move(value), "a right-handed frame",
                       std::move(remedy));
}

std::optional<hal::Error> check_turns(const RigStream& rig, const std::vector<ReferencePose>& reference,
                                      double offset_s, const Matrix3d& positions) {
  const auto plain = [](const ReferencePose& p) { return *p.orientation; };
  const TurnRelation relation = relate_turns(rig, reference, offset_s, plain);
  if (relation.count < 20) return std::nullopt;
  constexpr double kSameRad = 0.1;
  constexpr double kSameAxisRad = 0.35;
  if (relation.disagreement_rad > kSameRad || relation.residual > kSameAxisRad) {
    const auto last_first = [](const ReferencePose& p) {
      const Quaterniond& q = *p.orientation;
      return Quaterniond(q.z(), q.w(), q.x(), q.y()).normalized();
    };
    const auto back = [](const ReferencePose& p) { return p.orientation->conjugate(); };
    const TurnRelation reordered = relate_turns(rig, reference, offset_s, last_first);
    const TurnRelation inverse = relate_turns(rig, reference, offset_s, back);
    const auto misses = [](const TurnRelation& r) {
      return r.map.determinant() < 0.0 ? HUGE_VAL : r.disagreement_rad + r.residual;
    };
    const bool is_inverse = misses(inverse) < misses(reordered);
    const TurnRelation& better = is_inverse ? inverse : reordered;
    if (better.disagreement_rad < kSameRad && better.residual < kSameAxisRad) {
      if (is_inverse) {
        return poses_refusal("the orientations turn the other way", "",
                             "marker coordinates into the tracker's", "send the inverse rotation");
      }
      return poses_refusal("the orientations are written x, y, z, w", "", "w, x, y, z",
                           "exchange the quaternion's numbers");
    }
    return poses_refusal("the orientations do not follow the tool",
                         fmt::format("off by {:.0f}° in the median",
                                     57.3 * std::max(relation.disagreement_rad, relation.residual)),
                         "20°", "see whether the marker is fixed to the tool");
  }
  if (relation.map.determinant() < 0.0) {
    return poses_refusal("the orientations are of a left-handed frame", "", "the frame of the positions",
                         "send positions and orientations of one right-handed frame");
  }
  const Matrix3d between = positions * relation.map.transpose();
  const double angle = std::acos(std::clamp(0.5 * (between.trace() - 1.0), -1.0, 1.0));
  if (angle > 0.35) {
    const std::string words = in_words(between);
    return poses_refusal("positions and orientations have different axes",
                         words.empty() ? fmt::format("turned by {:.0f}°", 57.3 * angle) : words,
                         "the same axes", "send both in one frame");
  }
  return std::nullopt;
}

}  // namespace

std::optional<hal::Error> check_stream(const RigStream& rig, const std::vector<ReferencePose>& reference,
                                       const ArmFitSettings& settings) {
  if (auto error = check_stamps(reference)) return error;
  const auto offset = find_offset(rig, reference, settings.earliest_s, settings.latest_s);
  if (!offset) {
    return poses_refusal(
        "the tracker's poses and the rig's do not fall together in time",
        fmt::format("stamps {:.2f} … {:.2f} s, rig {:.2f} … {:.2f} s", reference.front().stamp_s,
                    reference.back().stamp_s, rig.begin_s(), rig.end_s()),
        "half of them do", "push poses while the rig runs, with stamps of the rig's clock; or say own_clock");
  }
  if (auto error = check_frozen(rig, reference, offset->offset_s)) return error;
  std::vector<MarkerPair> pairs;
  Vector3d mean = Vector3d::Zero();
  bool with_orientation = true;
  for (const ReferencePose& seen : reference) {
    const auto pose = rig.at(seen.stamp_s - offset->offset_s);
    if (!pose) continue;
    pairs.push_back({pose->tip_mm, pose->orientation.toRotationMatrix(), seen.position_mm});
    mean += pose->tip_mm;
    with_orientation = with_orientation && seen.orientation.has_value();
  }
  mean /= static_cast<double>(std::max<std::size_t>(1, pairs.size()));
  Matrix3d spread = Matrix3d::Zero();
  for (const MarkerPair& p : pairs) spread += (p.tip_mm - mean) * (p.tip_mm - mean).transpose();
  spread /= static_cast<double>(std::max<std::size_t>(1, pairs.size()));
  const double thin_mm = std::sqrt(std::max(0.0, linear_algebra::symmetric_eigen(spread).values[0]));
  if (pairs.size() < kMinReferencePoses || thin_mm < kMinSpreadMm) {
    return poses_refusal("the motion is too flat to tell a frame from its mirror image",
                         fmt::format("{:.1f} mm across", thin_mm), "at least 8 mm, standard deviation",
                         "move the tip through the whole workspace, in all three directions");
  }
  if (auto error = check_jump(rig, reference, settings)) return error;
  if (offset->correlation < kMinCorrelation) {
    return poses_refusal("the tracker does not see the device move",
                         fmt::format("correlation of the speeds {:.2f}", offset->correlation), "0.3 … 1",
                         "see whether the marker is on the tool and the stamps are of the rig's clock");
  }
  const auto right = fit_rigid(pairs, false, true);
  const auto left = fit_rigid(pairs, true, true);
  if (left && (!right || left->median_residual_mm < 0.5 * right->median_residual_mm)) {
    Matrix3d map = left->transform.rotation.toRotationMatrix();
    map.row(0) = -map.row(0);
    std::optional<Matrix3d> turns;
    if (with_orientation) {
      const TurnRelation relation = relate_turns(rig, reference, offset->offset_s,
                                                 [](const ReferencePose& p) { return *p.orientation; });
      if (relation.count >= 20) turns = relation.map;
    }
    return mirrored(map, turns);
  }
  if (!right) {
    return poses_refusal("the positions follow no rigid motion", "", "",
                         "see whether the marker is fixed to the tool");
  }
  if (auto error = check_scale(right->scale)) return error;
  if (!with_orientation) return std::nullopt;
  return check_turns(rig, reference, offset->offset_s, right->transform.rotation.toRotationMatrix());
}

}  // namespace hapticd::calibration
