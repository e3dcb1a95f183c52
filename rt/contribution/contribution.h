#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "hal/samples.h"
#include "rt/contribution/contact_state.h"
#include "rt/record/tick_record.h"

namespace hapticd::rt {

/// An effect that adds a force to what a scene renders. All calls come from the tick: bounded time, no
/// allocation, no lock, no exception.
class Contribution {
 public:
  virtual ~Contribution() = default;

  /// Advances by one tick, in contact or not. Returns the force on the tip, N, rig frame.
  virtual hal::Vector3 update(const ContactState& now) noexcept = 0;
  /// Fills its groups of the record, after update() with the same state: all fields in every tick, since a
  /// record may still hold what it was filled with earlier. It is const, so that nothing of a record finds
  /// its way into a force.
  virtual void fill_record(const ContactState& /*now*/, TickRecord& /*record*/) const noexcept {}
  /// Forgets what it knows of the contact.
  virtual void reset() noexcept = 0;
};

/// What a scene adds to its stiffness, composed at load, in the order in which it is summed.
struct Contributions {
  using List = std::vector<std::unique_ptr<Contribution>>;

  List desired;  ///< scaled by the contact's authority and bounded with the stiffness, through the controller
  List direct;   ///< added to the command as they are: the controller's lag would smear them
  std::uint32_t channels = 0;  ///< groups of the record that they fill (bits of channel::)
};

}  // namespace hapticd::rt
