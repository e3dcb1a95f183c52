#pragma once

#include <cstdint>
#include <optional>

#include "hal/samples.h"
#include "rt/assist/presentation_monitor.h"
#include "rt/assist/tool_fixture.h"
#include "rt/assist/tool_guide.h"
#include "rt/assist/tool_speed.h"
#include "rt/assist/touch.h"
#include "rt/record/tick_record.h"

namespace hapticd::rt {

/// What a scene has in addition to what it renders.
struct AssistanceSpec {
  hal::Vector3 press_axis{0.0, 0.0, -1.0};
  std::optional<FixtureParameters> fixture{};
  std::optional<WatchLimits> watch{};
};

/// What an experiment needs in the tick in addition to rendering: the guide, the scene's fixture, the scene's
/// watch. What is not used costs a branch.
class Assistance {
 public:
  explicit Assistance(double rate_hz) noexcept : rate_hz_(rate_hz) {}

  /// Exchanges the scene's part. A guide that leads the tool goes on; the fixture's force fades within
  /// kLeaveS, or goes at once if no scene follows; a presentation under way is not valid.
  void exchange(const AssistanceSpec& spec, bool fades = true) noexcept;
  /// Returns its number, from 1. One that is under way ends as cancelled.
  std::uint32_t begin_guide(const GuideMotion& motion) noexcept;
  void cancel_guide() noexcept { guide_.cancel(); }
  /// Force of guide and fixture as wanted in the last tick, rig frame.
  hal::Vector3 force_n() const noexcept { return guide_force_n_ + fixture_force_n_; }
  /// Returns its number, from 1; 0 without a watch. One that is under way is forgotten.
  std::uint32_t begin_presentation() noexcept;
  /// Ends a presentation; number 0 if none is under way.
  PresentationSummary end_presentation() noexcept;

  /// True while there is neither fixture, nor what it left, nor watch, and the device has never led the tool:
  /// update(), observe() and fill_record() are then not needed.
  bool is_idle() const noexcept {
    return guide_.number() == 0 && !fixture_ && !watch_ && leaving_share_ == 0.0;
  }
  /// Force on the tip, rig frame. `touch`: of the scene's pipeline with this sample.
  /// `interval_s` > 0 since the last tick.
  hal::Vector3 update(const hal::RigSample& sample, const Touch& touch, bool is_force_allowed,
                      double interval_s) noexcept;
  /// Lets the watch observe the tick after update(), once the guard has let a force through.
  void observe(const WatchedTick& now, double interval_s) noexcept {
    if (watch_) watch_->update(now, is_touched_, speed_.velocity_mm_per_s(), interval_s);
  }
  /// Fills its group of the record.
  void fill_record(TickRecord& record) const noexcept;

 private:
  double rate_hz_;
  ToolSpeed speed_;
  bool is_touched_ = false;  ///< from an evident contact on, until it ends
  ToolGuide guide_;
  static constexpr double kLeaveS = 0.02;
  hal::Vector3 guide_force_n_;
  hal::Vector3 fixture_force_n_;
  hal::Vector3 leaving_n_;  ///< of the fixture of the scene before
  double leaving_share_ = 0.0;
  std::optional<ToolFixture> fixture_;
  std::optional<PresentationMonitor> watch_;
  std::uint32_t presentations_ = 0;
};

}  // namespace hapticd::rt
