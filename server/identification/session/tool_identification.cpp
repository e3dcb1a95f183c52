#include "server/identification/session/tool_identification.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "rt/signal/vector.h"
#include "server/identification/session/fixed_text.h"

namespace hapticd::identification {

namespace {

constexpr double kSummedHz = 60.0;  // ten times the filter's cut-off: more repeats itself
constexpr double kBlockS = 1.0;
constexpr double kStretchS = 4.0;      // so long the sensor's zero counts as one; several turns of a hand
constexpr double kEnoughMass = 0.004;  // relative standard error
constexpr double kEnoughCentreMm = 0.2;
constexpr double kSteadyMass = 0.01;
constexpr double kSteadyCentreMm = 0.5;
constexpr double kOutlier = 4.0;
constexpr std::size_t kShown = 200;

double greatest(const hal::Vector3& v) noexcept {
  return std::max({v.x, v.y, v.z});
}
std::uint64_t stride_of(const hal::RigInfo& rig) noexcept {
  return static_cast<std::uint64_t>(std::max(1.0, std::floor(rig.rate_hz / kSummedHz)));
}

/// "known to 3.1 %", or "not yet known".
std::string known_to(double value, int digits, const char* unit) {
  return std::isfinite(value) ? "known to " + fixed_text(value, digits) + unit : "not yet known";
}

}  // namespace

ToolIdentification::ToolIdentification(const ToolTask& /*task*/, const hal::RigInfo& rig)
    : IdentificationSession(tool_kind(), rig.rate_hz / static_cast<double>(stride_of(rig))),
      stride_(stride_of(rig)),
      summed_hz_(rig.rate_hz / static_cast<double>(stride_)),
      gate_(tool_policy(rig)),
      filter_(rig.rate_hz, rig.kind != hal::RigKind::kReplay),
      samples_per_block_(std::max(10.0, kBlockS * summed_hz_)) {
  blocks_.reserve(kMaxBlocks);
  shown_.reserve(kShown);
}

void ToolIdentification::add(const rt::Observation& observation) {
  const SampleGate::Verdict verdict = gate_.judge(observation);
  // A force missing from one tick is part of the next mean.
  if (verdict == SampleGate::Verdict::kSkip) return;
  if (verdict != SampleGate::Verdict::kUse) filter_.reset();
  if (verdict == SampleGate::Verdict::kInterrupt) return;
  const std::optional<ToolExcitation> excitation = filter_.update(observation.sample);
  if (!excitation || filtered_++ % stride_ != 0) return;

  if (blocks_.empty() || blocks_.back().samples >= samples_per_block_) {
    if (blocks_.size() == kMaxBlocks) {
      for (std::size_t i = 0; i < kMaxBlocks / 2; ++i) {
        ToolMoments joined = blocks_[2 * i];
        joined.add(blocks_[2 * i + 1]);
        blocks_[i] = joined;
      }
      blocks_.resize(kMaxBlocks / 2);
      samples_per_block_ *= 2.0;
    }
    blocks_.emplace_back();
  }
  blocks_.back().add(*excitation);
  ++used_;

  const hal::Vector3& g = excitation->gravity_in_tool;
  constexpr double kDegrees = 180.0 / std::numbers::pi;
  visit(0, kDegrees * std::atan2(-g.y, -g.z), kDegrees * std::atan2(g.x, -g.z));

  if (used_ % show_every_ == 0) {
    if (shown_.size() == kShown) {
      for (std::size_t i = 0; i < kShown / 2; ++i) shown_[i] = shown_[2 * i];
      shown_.resize(kShown / 2);
      show_every_ *= 2;
    }
    shown_.push_back(*excitation);
  }
}

ToolMoments ToolIdentification::without_drift(const std::vector<ToolMoments>& blocks) const {
  const double samples_per_stretch = kStretchS * summed_hz_;
  ToolMoments all, last, stretch;
  for (const ToolMoments& block : blocks) {
    stretch.add(block);
    if (stretch.samples < samples_per_stretch) continue;
    all.add(last.centred());
    last = stretch;
    stretch = {};
  }
  last.add(stretch);
  all.add(last);
  return all;
}

ToolIdentification::Estimate ToolIdentification::estimate(std::size_t count) const {
  Estimate result;
  count = std::min(count, blocks_.size());
  result.fit =
      fit_tool_load(without_drift({blocks_.begin(), blocks_.begin() + static_cast<std::ptrdiff_t>(count)}));
  result.blocks = count;
  if (!result.fit.good) return result;

  // Blocks that fit far worse than half of them do are left out. Twice: one gross error hides the next.
  for (int round = 0; round < 2 && count >= 8; ++round) {
    std::vector<double> left;
    for (std::size_t i = 0; i < count; ++i) left.push_back(misfit(result.fit, blocks_[i].centred()).force_n2);
    std::vector<double> sorted = left;
    std::nth_element(sorted.begin(), sorted.begin() + static_cast<std::ptrdiff_t>(count / 2), sorted.end());
    const double bound = kOutlier * kOutlier * sorted[count / 2] + 1e-12;
    std::vector<ToolMoments> kept;
    std::size_t out = 0;
    for (std::size_t i = 0; i < count; ++i) {
      if (left[i] > bound) {
        ++out;
      } else {
        kept.push_back(blocks_[i]);
      }
    }
    if (out == result.left_out || 3 * out > count) break;
    const ToolLoadFit refined = fit_tool_load(without_drift(kept));
    if (!refined.good) break;
    result.fit = refined;
    result.left_out = out;
  }

  // Residuals resemble their neighbours: filtered at f_c, only 2 f_c of them a second are independent.
  const double widen = std::sqrt(std::max(1.0, summed_hz_ / (2.0 * filter_.cutoff_hz())));
  ToolLoadFit& fit = result.fit;
  fit.mass_error_g *= widen;
  for (hal::Vector3* error : {&fit.rotation_error_rad, &fit.force_bias_error_n, &fit.torque_bias_error_n_mm,
                              &fit.arm_error_mm, &fit.centre_error_mm}) {
    *error = *error * widen;
  }
  return result;
}

std::vector<rt::EstimatedParameter> ToolIdentification::parameters(const ToolLoadFit& fit) const {
  std::vector<rt::EstimatedParameter> all;
  const auto vector = [&](const std::string& name, const std::string& unit, const std::string& unit_name,
                          const hal::Vector3& value, const hal::Vector3& error) {
    all.push_back({name + "_x" + unit_name, unit, value.x, error.x});
    all.push_back({name + "_y" + unit_name, unit, value.y, error.y});
    all.push_back({name + "_z" + unit_name, unit, value.z, error.z});
  };
  all.push_back({"mass_g", "g", fit.mass_g, fit.mass_error_g});
  vector("centre", "mm", "_mm", fit.centre_mm, fit.centre_error_mm);
  vector("force_bias", "N", "_n", fit.force_bias_n, fit.force_bias_error_n);
  vector("torque_bias", "N·mm", "_n_mm", fit.torque_bias_n_mm, fit.torque_bias_error_n_mm);
  const hal::Quaternion& q = fit.sensor_to_tool;
  const hal::Vector3 axis{q.x, q.y, q.z};
  const double sine = rt::norm(axis);
  const double angle = 2.0 * std::atan2(sine, q.w);
  vector("sensor_to_tool", "rad", "_rad", axis * (sine > 1e-9 ? angle / sine : 2.0), fit.rotation_error_rad);
  vector("tip_to_centre", "mm", "_mm", fit.arm_mm, fit.arm_error_mm);
  return all;
}

void ToolIdentification::find(IdentificationProgress& progress) const {
  progress.samples = used_;
  progress.duration_s = gate_.watched_s();
  const bool covered = progress.missing.empty();

  const Estimate now = estimate(blocks_.size());
  const ToolLoadFit& fit = now.fit;
  double mass_share = std::numeric_limits<double>::infinity();
  double centre_error = std::numeric_limits<double>::infinity();
  if (fit.good) {
    progress.parameters = parameters(fit);
    progress.residual = fit.residual;
    mass_share = fit.mass_error_g / std::max(1e-9, std::abs(fit.mass_g));
    centre_error = greatest(fit.centre_error_mm);
    if (now.blocks >= 6) {
      const Estimate before = estimate(2 * now.blocks / 3);
      progress.steady = before.fit.good &&
                        std::abs(before.fit.mass_g - fit.mass_g) < kSteadyMass * std::abs(fit.mass_g) &&
                        (!fit.has_torque || rt::norm(before.fit.centre_mm - fit.centre_mm) < kSteadyCentreMm);
    }
    progress.certain = mass_share < kEnoughMass && (!fit.has_torque || centre_error < kEnoughCentreMm);
    for (const ToolExcitation& e : shown_) {
      const hal::Vector3 arm = fit.arm_mm;
      const hal::Vector3 turning{dot(e.turning_n_per_g_mm[0], arm), dot(e.turning_n_per_g_mm[1], arm),
                                 dot(e.turning_n_per_g_mm[2], arm)};
      const hal::Vector3 tool = (e.weight_n_per_g - turning) * fit.mass_g;
      const hal::Vector3 measured = rt::rotated(fit.sensor_to_tool, e.force_n - fit.force_bias_n);
      // The components take turns.
      const std::size_t i = progress.fit.size() % 3;
      const double model = i == 0 ? tool.x : i == 1 ? tool.y : tool.z;
      progress.fit.push_back({model, i == 0 ? measured.x : i == 1 ? measured.y : measured.z, model});
    }
  }
  progress.converged = covered && fit.mass_g > 0.0;
  const double closeness = std::isfinite(mass_share) ? std::min(1.0, kEnoughMass / mass_share) : 0.0;
  const double share = progress.coverage.front().share;
  progress.completion = 0.5 * share + 0.45 * share * closeness;
  if (!progress.certain && fit.good) {
    progress.missing.push_back("wave the tool longer: mass " + known_to(100.0 * mass_share, 1, " %") +
                               ", centre " + known_to(centre_error, 2, " mm"));
  }
  if (progress.certain && !progress.steady) {
    progress.missing.push_back("go on a little: mass or centre still moved in the last third");
  }
  if (progress.missing.empty()) progress.missing.push_back("turn and wave the tool in free air");

  progress.remarks = gate_.remarks();
  if (now.left_out > 0) {
    progress.remarks.push_back(
        std::to_string(now.left_out) +
        " seconds or longer left out that fit four times worse: was something touched?");
  }
  if (fit.good && !fit.has_torque) {
    progress.remarks.push_back("the sensor gives no torque: the centre of mass cannot be reported");
  }
  if (fit.good && std::isinf(greatest(fit.rotation_error_rad)) && std::isfinite(fit.mass_error_g)) {
    progress.remarks.push_back(
        "the sensor's rotation is not reported by these orientations: taken as unturned");
  }
}

std::optional<hal::Error> ToolIdentification::conclude(const IdentificationProgress& now,
                                                       rt::IdentifiedModel& model) const {
  if (used_ < 30) {
    return refusal("too few samples",
                   std::to_string(used_) + " that could be used of " + std::to_string(gate_.judged()),
                   "at least 30 filtered samples without faults and gaps, about a second",
                   "turn and wave the tool in free air");
  }
  const ToolLoadFit fit = estimate(blocks_.size()).fit;
  if (!fit.good || !std::isfinite(fit.mass_error_g)) {
    return refusal("the motion does not determine the tool's mass", "",
                   "gravity from several directions, or acceleration",
                   now.missing.empty() ? "turn the tool" : now.missing.front());
  }
  if (!(fit.mass_g > 0.0)) {
    return refusal("the mass comes out negative", fixed_text(fit.mass_g, 2) + " g", "more than 0 g",
                   "the sensor's sign is reversed: it must show the force on the tool");
  }
  rt::ToolModel tool;
  tool.mass_g = fit.mass_g;
  tool.centre_mm = fit.centre_mm;
  tool.force_bias_n = fit.force_bias_n;
  tool.torque_bias_n_mm = fit.torque_bias_n_mm;
  tool.sensor_to_tool = fit.sensor_to_tool;
  constexpr double kUsefulArmMm = 5.0;  // three sigma of it are a small part of any tool
  if (greatest(fit.arm_error_mm) < kUsefulArmMm) tool.tip_to_centre_mm = fit.arm_mm;
  model.content = tool;
  model.procedure =
      fixed_text(gate_.watched_s(), 1) + " s of free motion, least squares over weight and inertia (4.5)";
  return std::nullopt;
}

}  // namespace hapticd::identification
