#pragma once

#include <cstdint>

#include "hal/samples.h"
#include "rt/scene/tick_record.h"

namespace hapticd::rt {

/// The stages of one scene, composed. All calls come from the thread that owns the clock.
class Pipeline {
 public:
  virtual ~Pipeline() = default;

  /// Groups this pipeline fills (bits of channel::).
  virtual std::uint32_t channels() const noexcept = 0;

  /// One tick: fills the record's groups and returns the force wanted of the device (rig frame, N). Called
  /// only with finite samples; bounded time, no allocation, no lock, no exception.
  virtual hal::Vector3 evaluate(const hal::RigSample& sample, TickRecord& record) noexcept = 0;

  /// What the guard let through: the controller's observer f_d(k) = f_c(k-1) works on this, so a bounded or
  /// latched command never winds it up.
  virtual void applied(const hal::Vector3& force_n) noexcept = 0;

  /// Forget all that was estimated (after a fault or at load); the next sample seeds everything anew, and
  /// contact is declared only once the tool was seen free.
  virtual void reset() noexcept = 0;

  /// New target, reached linearly over `ramp_s` from the value in force now.
  virtual void set_target(double stiffness_n_per_mm, double ramp_s) noexcept = 0;
};

}  // namespace hapticd::rt
