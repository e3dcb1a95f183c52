#pragma once

#include <optional>

#include "hal/error.h"
#include "hal/rig.h"
#include "hal/samples.h"

namespace hapticd::hal {

/// An instrument next to the device that measures where the tip really is (an LVDT, a dial gauge, a laser).
/// Unlike the encoders it sees the device bend.
class TipInstrument : public RigPart {
 public:
  /// Overwrites what it measures of a position in the rig frame (mm, any origin) and leaves the rest as it
  /// is. False, and nothing overwritten: no fit reading since the last call. Neither blocks nor allocates.
  virtual bool read(Vector3& position_mm) noexcept = 0;
};

/// A rig whose instrument has hardware behind it: opened for as long as it is needed.
class InstrumentedRig {
 public:
  virtual ~InstrumentedRig() = default;
  /// Opens it and returns once it delivers, or says why it does not; without an instrument nothing happens.
  /// Any thread but the clock's; from then on Rig::external_position() answers.
  virtual std::optional<Error> engage_instrument() = 0;
  /// Lets go of it; no other thread than engage_instrument()'s.
  virtual void disengage_instrument() noexcept = 0;
};

}  // namespace hapticd::hal
