#pragma once

#include <cstdint>

#include "hal/samples.h"
#include "rt/assist/touch.h"
#include "rt/guard/fault_table.h"
#include "rt/record/tick_record.h"
#include "rt/signal/followed_zero.h"
#include "rt/target/target_law.h"

namespace hapticd::rt {

/// What a pipeline makes of a tick, for the renderer, the guard and the assistance.
struct PipelineOutput {
  hal::Vector3 force_n;  ///< wanted of the device, rig frame
  bool in_contact = false;
  bool wants_force = false;    ///< more than a trace is desired, in contact or while a release fades
  std::uint8_t held_back = 0;  ///< bits of guard_limit: what the scene itself bounded
  Touch touch{};               ///< for guide, fixture and watch
  FaultSet faults = 0;         ///< of the rig, noticed with this sample: those of Pipeline::faults()
};

/// The stages of one scene, composed. All calls come from the thread that owns the clock.
class Pipeline {
 public:
  /// A desired force below this is a trace and not wanted [N].
  static constexpr double kTraceN = 1e-3;

  Pipeline() = default;
  Pipeline(const Pipeline&) = delete;
  Pipeline& operator=(const Pipeline&) = delete;
  virtual ~Pipeline() = default;

  /// Groups this pipeline fills (bits of channel::).
  virtual std::uint32_t channels() const noexcept = 0;

  /// Evaluates one tick. Called only with finite samples; bounded time, no allocation, no lock, no exception.
  virtual PipelineOutput evaluate(const hal::RigSample& sample) noexcept = 0;

  /// Fills its groups of the record with the tick that was evaluated; to be called before applied(). What it
  /// fills in one tick it fills in all: a record may still hold what it was filled with earlier. It is const,
  /// so that nothing of a record finds its way into a force.
  virtual void fill_record(TickRecord& record) const noexcept = 0;

  /// Takes what the guard let through: the controller's observer f_d(k) = f_c(k-1) works on this, so a
  /// bounded or latched command never winds it up.
  virtual void applied(const hal::Vector3& force_n) noexcept = 0;

  /// Forgets all that was estimated (after a fault or at load); the next sample seeds everything again, and
  /// contact is declared only once the tool was seen free.
  virtual void reset() noexcept = 0;

  /// Faults of the rig that it noticed with the last sample, or in the zero that it took over.
  virtual FaultSet faults() const noexcept { return 0; }
  /// Zero of the sensor as it is followed; another pipeline goes on from it.
  virtual FollowedZero zero() const noexcept { return {}; }
  virtual void adopt_zero(const FollowedZero& /*zero*/) noexcept {}
  /// Distrusts the sensor because its zero is not proven (LoadMonitor): no reading counts, contact begins
  /// only after the tool was seen free again.
  virtual void distrust_sensor() noexcept {}
  /// Takes note that the sensor was biased just now, with the tool held so.
  virtual void biased_at(const hal::Quaternion& /*orientation*/) noexcept {}

  /// Sets a new target, reached over `ramp_s` from the force of the present one. One-dimensional scenes know
  /// linear targets only; the caller has checked.
  virtual void set_target(const TargetLaw& target, double ramp_s) noexcept = 0;
};

}  // namespace hapticd::rt
