#include "server/identification/session/threshold_identification.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "rt/contact/contact_detector.h"
#include "rt/signal/vector.h"
#include "server/identification/session/fixed_text.h"

namespace hapticd::identification {

namespace {

constexpr double kSecondS = 1.0;  // residuals further apart are independent: the filters remember 0.15 s
constexpr double kMinN = 1e-4;
constexpr double kMaxN = 100.0;
constexpr double kTopSpeedMmPerS = 400.0;   // of the classes
constexpr double kEnoughLevelError = 0.25;  // of ε_f, relative
constexpr double kSmallRecord = 1.15;       // times the one before
constexpr double kAlone = 4.0;              // times the third greatest second: hardly free motion
// A threshold beyond that is not used by a scene that states no other bound.
constexpr double kHeldN = rt::ContactParameters{}.zero_bound_n;

// A class may hold seconds of two kinds, with a strike and without: its upper quarter is of one kind.
constexpr double kTailShare = 0.25;
constexpr std::uint64_t kFewSeconds = 10;
constexpr std::size_t kLevelCount = 480;

double value_of(std::size_t level) noexcept {
  return kMinN * std::pow(kMaxN / kMinN, (static_cast<double>(level) + 0.5) / kLevelCount);
}

/// Angle from one orientation to the other, 0 … 180.
double angle_deg(const hal::Quaternion& a, const hal::Quaternion& b) noexcept {
  const double half_cosine = std::abs(a.w * b.w + a.x * b.x + a.y * b.y + a.z * b.z);
  return 2.0 * std::acos(std::min(1.0, half_cosine)) * 180.0 / std::numbers::pi;
}

}  // namespace

ThresholdIdentification::ThresholdIdentification(const ThresholdTask& task, const hal::RigInfo& rig)
    : IdentificationSession(threshold_kind(), rig.rate_hz),
      task_(task),
      tool_mass_g_(rig.sensor.tool_mass_g),
      gate_(threshold_policy()),
      load_(rig.sensor.tool_mass_g, hal::Vector3{0.0, 0.0, -1.0}),
      residual_(rig.sensor.tool_mass_g, std::max(100.0, rig.rate_hz)) {}

void ThresholdIdentification::close_second() {
  if (second_s_ >= 0.5 * kSecondS) {
    const double share = std::log(std::max(second_largest_n_, kMinN) / kMinN) / std::log(kMaxN / kMinN);
    const double level = std::clamp(std::floor(share * kLevels), 0.0, kLevels - 1.0);
    const double speed =
        std::clamp(std::floor(second_top_speed_ / kTopSpeedMmPerS * kClasses), 0.0, kClasses - 1.0);
    ++levels_[static_cast<std::size_t>(speed)][static_cast<std::size_t>(level)];
    ++seconds_;
  }
  second_s_ = 0.0;
  second_largest_n_ = 0.0;
  second_top_speed_ = 0.0;
}

void ThresholdIdentification::add(const rt::Observation& observation) {
  const hal::RigSample& sample = observation.sample;
  const SampleGate::Verdict verdict = gate_.judge(observation);
  if (verdict == SampleGate::Verdict::kSkip) return;
  if (verdict == SampleGate::Verdict::kInterrupt) {
    residual_.reset();
    settled_s_ = 0.0;
    return;
  }
  const double step_s = gate_.step_s();
  const bool follows = verdict == SampleGate::Verdict::kUse && step_s > 0.0;
  if (!follows) {
    settled_s_ = 0.0;
    velocity_mm_per_s_ = {};
  }
  // Residual at the instants at which each was measured, as the detector has it.
  const hal::Vector3 r =
      residual_.update({load_.without_weight_n(sample) * -1.0, sample.tip_position_mm,
                        sample.time_ns - sample.position_age_ns, sample.time_ns - sample.force_mean_age_ns},
                       false);
  if (follows) {
    settled_s_ += step_s;
    const hal::Vector3 velocity = (sample.tip_position_mm - last_position_mm_) * (1.0 / step_s);
    velocity_mm_per_s_ = velocity_mm_per_s_ + (velocity - velocity_mm_per_s_) * 0.05;
  }
  last_position_mm_ = sample.tip_position_mm;
  // The detector allows for what irregular ticks leave uncertain: it does not belong to the threshold.
  const double size_n = std::max(0.0, rt::norm(r) - residual_.irregular_n());
  if (settled_s_ < kThresholdSettlingS) {
    held_n_ = size_n > kHeldN ? size_n : 0.0;
    if (held_n_ > 0.0) settled_s_ = 0.0;
    return;
  }
  held_n_ = 0.0;

  ++used_;
  observed_s_ += step_s;
  second_s_ += step_s;
  second_largest_n_ = std::max(second_largest_n_, size_n);
  if (size_n > largest_n_) {
    // A force that rises tick by tick is one record, not many.
    if (observed_s_ > largest_at_s_ + 0.1) largest_before_n_ = largest_n_;
    largest_n_ = size_n;
    largest_at_s_ = observed_s_;
  }
  second_top_speed_ = std::max(second_top_speed_, rt::norm(velocity_mm_per_s_));
  top_speed_mm_per_s_ = std::max(top_speed_mm_per_s_, second_top_speed_);
  if (second_s_ >= kSecondS) close_second();

  const hal::Quaternion orientation = rt::unit(sample.tip_orientation);
  if (!first_orientation_) first_orientation_ = orientation;
  visit(0, rt::norm(velocity_mm_per_s_));
  visit(1, angle_deg(*first_orientation_, orientation));
}

ThresholdIdentification::Tail ThresholdIdentification::tail_of(
    const std::array<std::uint32_t, kLevels>& levels, std::uint64_t seconds) {
  Tail tail;
  tail.levels = levels;
  tail.seconds = seconds;
  std::uint64_t below = 0;
  std::size_t middle = 0;
  for (; middle + 1 < kLevels; ++middle) {
    below += levels[middle];
    if (static_cast<double>(below) >= (1.0 - kTailShare) * static_cast<double>(seconds)) break;
  }
  tail.quartile_n = value_of(middle);
  double excess = 0.0, above = 0.0;
  for (std::size_t i = middle + 1; i < kLevels; ++i) {
    excess += levels[i] * (value_of(i) - tail.quartile_n);
    above += levels[i];
  }
  // No second is known better than to a level.
  const double level_n = tail.quartile_n * (std::pow(kMaxN / kMinN, 1.0 / kLevels) - 1.0);
  above = std::max(1.0, above);
  tail.scale_n = std::max(level_n, excess / above);
  const double efolds =
      std::log(std::max(1.0, above / static_cast<double>(seconds) * kAlarmFreeS / kSecondS));
  tail.level_n = tail.quartile_n + tail.scale_n * efolds;
  tail.level_error_n = tail.scale_n * efolds / std::sqrt(above);
  tail.known = true;
  return tail;
}

ThresholdIdentification::Tail ThresholdIdentification::tail() const {
  Tail worst;
  std::array<std::uint32_t, kLevels> merged{};
  std::uint64_t seconds = 0;
  for (std::size_t c = kClasses; c-- > 0;) {
    for (std::size_t i = 0; i < kLevels; ++i) {
      merged[i] += levels_[c][i];
      seconds += levels_[c][i];
    }
    if (seconds < kFewSeconds) continue;
    const Tail tail = tail_of(merged, seconds);
    if (!worst.known || tail.level_n > worst.level_n) worst = tail;
    merged = {};
    seconds = 0;
  }
  return worst;
}

std::string ThresholdIdentification::wait() const {
  if (held_n_ == 0.0) return "";
  return "take the tool off what it touches: free motion counts once there is less than " +
         fixed_text(kHeldN, 2) + " N on it, now " + fixed_text(held_n_, 2) + " N";
}

MotionRequest ThresholdIdentification::next_request() const {
  MotionRequest request = IdentificationSession::next_request();
  if (held_n_ > 0.0) request.words = wait();
  return request;
}

/// Rest, sway and strikes take turns, each a few seconds.
std::size_t ThresholdIdentification::turn() const {
  const double per_turn_s = std::max(4.0, task_.duration_s / 5.0);
  return static_cast<std::size_t>(std::floor(observed_s_ / per_turn_s));
}

void ThresholdIdentification::find(IdentificationProgress& progress) const {
  progress.samples = used_;
  progress.duration_s = gate_.watched_s();
  const bool covered = progress.missing.empty();
  const Tail tail = this->tail();

  if (seconds_ > 0) {
    progress.parameters.push_back(
        {"largest_residual_n", "N", largest_n_, tail.known ? tail.scale_n : HUGE_VAL});
    progress.parameters.push_back({"independent_seconds", "1", static_cast<double>(seconds_), 0.0});
    const double next = 1.0 / (static_cast<double>(seconds_) + 1.0);
    progress.parameters.push_back({"exceeded_in_next_second", "1", next, next});
  }
  if (tail.known) {
    const double threshold_n = std::max(largest_n_, tail.level_n);
    progress.parameters.insert(progress.parameters.begin(),
                               {"threshold_n", "N", threshold_n, tail.level_error_n});
    progress.parameters.push_back({"tail_scale_n", "N", tail.scale_n, tail.level_error_n});
    progress.steady = largest_at_s_ < 0.75 * observed_s_ || largest_n_ < kSmallRecord * largest_before_n_;
    progress.certain = tail.level_error_n < kEnoughLevelError * threshold_n;
    std::uint64_t above = tail.seconds;
    double square = 0.0, points = 0.0;
    for (std::size_t i = 0; i < kLevels && progress.fit.size() < 200; ++i) {
      if (tail.levels[i] == 0) continue;
      const double x = value_of(i);
      above -= tail.levels[i];
      const double measured = static_cast<double>(above) / static_cast<double>(tail.seconds);
      const double model = std::min(1.0, kTailShare * std::exp(-(x - tail.quartile_n) / tail.scale_n));
      progress.fit.push_back({x, measured, model});
      if (x >= tail.quartile_n) {
        square += (measured - model) * (measured - model);
        points += 1.0;
      }
    }
    progress.residual = points > 0.0 ? std::sqrt(square / points) : 0.0;
  }
  // A touch lasts into one more second at most; motion repeats itself.
  double third_n = 0.0;
  std::uint32_t greater = 0;
  for (std::size_t i = kLevels; i-- > 0 && third_n == 0.0;) {
    for (const auto& levels : levels_) greater += levels[i];
    if (greater >= 3) third_n = value_of(i);
  }
  const bool alone = third_n > 0.0 && largest_n_ > kAlone * third_n;
  const bool long_enough = observed_s_ >= task_.duration_s;
  progress.converged = covered && long_enough && !alone;
  progress.completion =
      0.95 * std::min(observed_s_ / std::max(1.0, task_.duration_s),
                      0.5 + 0.25 * (progress.coverage[0].share + progress.coverage[1].share));
  if (!long_enough) {
    progress.missing.push_back("free motion for " + fixed_text(task_.duration_s - observed_s_, 0) +
                               " s more");
  } else if (!progress.certain || !progress.steady) {
    progress.missing.emplace_back(progress.steady
                                      ? "free motion a while longer: the tail of the residual is uncertain"
                                      : "free motion a while longer: the largest residual is recent");
  }
  if (held_n_ > 0.0) progress.missing.insert(progress.missing.begin(), wait());
  if (alone) {
    progress.missing.insert(progress.missing.begin(), "start again, touching nothing");
    progress.remarks.push_back("the largest residual, " + fixed_text(1e3 * largest_n_, 0) + " mN after " +
                               fixed_text(largest_at_s_, 1) + " s, is alone: was something touched?");
  }

  for (std::string& remark : gate_.remarks()) progress.remarks.push_back(std::move(remark));
  if (!(tool_mass_g_ > 0.0)) {
    progress.remarks.emplace_back("the tool's mass is unknown: its weight and inertia count as residual");
  }
}

std::optional<hal::Error> ThresholdIdentification::conclude(const IdentificationProgress& /*now*/,
                                                            rt::IdentifiedModel& model) const {
  const Tail tail = this->tail();
  if (!tail.known && held_n_ > 0.0) {
    return refusal(
        "the tool was not free", fixed_text(held_n_, 2) + " N on it",
        "less than " + fixed_text(kHeldN, 2) + " N for " + fixed_text(kThresholdSettlingS, 1) + " s",
        "take the tool off what it touches; if it touches nothing, the sensor's zero is off: "
        "'hapticctl sensor bias'");
  }
  if (!tail.known) {
    return refusal("too little free motion",
                   fixed_text(observed_s_, 1) + " s of " + fixed_text(gate_.watched_s(), 1),
                   "at least 10 s without faults and gaps", "move the tool freely, touching nothing");
  }
  if (!(largest_n_ > 0.0)) {
    return refusal("the residual never moves", "0 N", "a sensor's own noise at least",
                   "check that the sensor delivers force");
  }
  rt::ThresholdModel threshold;
  threshold.largest_residual_n = largest_n_;
  threshold.threshold_n = std::max({largest_n_, tail.level_n, 1e-4});
  threshold.observed_s = observed_s_;
  model.content = threshold;
  model.procedure =
      "no alarm in " + fixed_text(observed_s_, 0) + " s of free motion; margin " +
      fixed_text(100.0 * (threshold.threshold_n / largest_n_ - 1.0), 0) +
      " % above the largest residual, for one alarm in ten minutes on an exponential tail (D§3.2.2)";
  model.validity.max_speed_mm_per_s = top_speed_mm_per_s_;
  return std::nullopt;
}

}  // namespace hapticd::identification
