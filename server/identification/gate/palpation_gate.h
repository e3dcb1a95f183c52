#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "hal/rig.h"
#include "hal/samples.h"

namespace hapticd::rt {

/// Decides which samples of a palpation are fit for use, and counts those that are not.
class PalpationGate {
 public:
  enum class Verdict : std::uint8_t {
    kUse,
    kSkip,     ///< this sample says nothing
    kRestart,  ///< fit, but after a gap: what was derived from its predecessors no longer holds
  };

  explicit PalpationGate(const hal::RigInfo& rig) noexcept;

  Verdict judge(const hal::RigSample& sample) noexcept;

  std::uint64_t judged() const noexcept { return judged_; }
  std::uint64_t used() const noexcept { return used_; }
  std::uint64_t gaps() const noexcept { return gaps_; }
  std::uint64_t saturated() const noexcept { return saturated_; }
  std::uint64_t non_finite() const noexcept { return non_finite_; }
  /// What was left out, in words; empty where all was fit.
  std::vector<std::string> remarks() const;

 private:
  bool clipped(double force_n, double depth_mm) noexcept;

  /// Longer than so many periods is a gap.
  static constexpr double kGapPeriods = 5.0;
  /// A force that repeats to the last bit at its extreme so often, while the tip moves, is an end of range.
  static constexpr int kClipRun = 4;

  double period_s_;
  double range_n_;
  bool started_ = false;
  std::int64_t last_time_ns_ = 0;
  std::uint64_t judged_ = 0, used_ = 0, gaps_ = 0, saturated_ = 0, non_finite_ = 0, missing_ = 0,
                disordered_ = 0;
  double longest_gap_s_ = 0.0;
  double last_force_n_ = 0.0, largest_n_ = 0.0, run_depth_mm_ = 0.0;
  double shallowest_mm_ = 0.0, deepest_mm_ = 0.0;
  int run_ = 0;
};

}  // namespace hapticd::rt
