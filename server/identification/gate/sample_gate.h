#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "rt/record/observation.h"
#include "server/identification/gate/clip_monitor.h"
#include "server/identification/gate/sample_policy.h"

namespace hapticd::identification {

/// Decides which samples an identification uses, by one policy a kind, and counts those it does not and why.
/// In constant time; allocates nothing but in remarks().
class SampleGate {
 public:
  enum class Verdict : std::uint8_t {
    kUse,
    kSkip,       ///< unfit: it says nothing
    kInterrupt,  ///< unfit, and what was derived from its predecessors no longer holds
    kRestart,    ///< fit, but after a gap: what was derived from its predecessors no longer holds
  };

  explicit SampleGate(const SamplePolicy& policy) noexcept : policy_(policy), clip_(policy.clip) {}

  Verdict judge(const hal::RigSample& sample) noexcept {
    return judge(rt::Observation{sample, {}, {}, false});
  }
  Verdict judge(const rt::Observation& observation) noexcept;

  /// Does the first half of judge(): a verdict only if the sample is unfit. Other checks can come between the
  /// two halves.
  std::optional<Verdict> refuse(const rt::Observation& observation) noexcept;
  /// Does the second half of judge(): a fit sample's place in time.
  Verdict follow(const rt::Observation& observation) noexcept;

  /// Makes the next sample follow on none.
  void forget() noexcept { follows_ = false; }

  /// Time since the fit sample before; 0 if the last one follows on none.
  double step_s() const noexcept { return step_s_; }
  std::uint64_t judged() const noexcept { return judged_; }
  std::uint64_t used() const noexcept { return used_; }
  /// Time from the first sample to the last one, fit or not.
  double watched_s() const noexcept { return last_s_ - first_s_; }
  std::uint64_t left_out(Unfit reason) const noexcept { return left_out_[static_cast<std::size_t>(reason)]; }
  /// Remarks on what was left out, in words; empty if all was fit.
  std::vector<std::string> remarks() const;

 private:
  bool is(Unfit reason, const rt::Observation& observation) noexcept;
  bool is_a_number(const rt::Observation& observation) const noexcept;
  Verdict leave_out(Unfit reason) noexcept;

  SamplePolicy policy_;
  ClipMonitor clip_;
  bool follows_ = false;
  std::int64_t last_time_ns_ = 0;
  double step_s_ = 0.0, longest_gap_s_ = 0.0;
  double first_s_ = 0.0, last_s_ = 0.0;
  std::uint64_t judged_ = 0, used_ = 0, gaps_ = 0, repeated_ = 0;
  std::array<std::uint64_t, kUnfitKinds> left_out_{};
};

}  // namespace hapticd::identification
