#pragma once

#include <cstdint>

#include "hal/samples.h"
#include "rt/contact/contact_stage.h"
#include "rt/contact/path_check.h"
#include "rt/contact/pull_monitor.h"
#include "rt/contribution/contact_state.h"
#include "rt/deformation/direction.h"
#include "rt/deformation/displacement.h"
#include "rt/record/tick_record.h"

namespace hapticd::rt {

/// Contact with an object of unknown shape and where its surface is: contact and its evidence, deformation
/// direction, displacement. Each needs the others, so they are one stage.
class ExploredContact {
 public:
  ExploredContact(const ContactParameters& parameters, double tool_mass_g, const Direction& direction,
                  const Displacement& displacement, double rate_hz) noexcept;

  /// Advances by one tick from `now.tool`, and fills in what is known of contact and geometry. Authority and
  /// the displacement that is rendered are the release's.
  void update(const hal::RigSample& sample, ContactState& now) noexcept;
  /// Fills the groups of contact, direction, displacement and fusion.
  void fill_record(const ContactState& now, TickRecord& record) const noexcept;
  void reset() noexcept;

  ContactStage3& stage() noexcept { return contact_; }
  const ContactStage3& stage() const noexcept { return contact_; }
  /// Displacement as it is estimated, negative above the surface.
  double displacement_mm() const noexcept { return displacement_.displacement_mm(); }

 private:
  void detect(const hal::RigSample& sample, const ToolState& tool) noexcept;
  /// True if the force reverses where the object was felt.
  bool is_pulled(const ToolState& tool, double reaction_n) noexcept;
  /// Estimates direction and displacement.
  void estimate(ContactState& now) noexcept;
  void begin(const ToolState& tool) noexcept;
  /// Ends a contact that nothing speaks for.
  void judge(const ContactState& now) noexcept;

  ContactParameters parameters_;
  ContactStage3 contact_;
  PullMonitor pull_;
  PathCheck path_check_;
  double path_mm_ = 0.0;  ///< into the object since the onset or the farthest retreat, along the normals
  std::uint32_t regain_ticks_;
  bool regained_ = false;  ///< the present contact was not seen to begin
  Direction direction_;
  Displacement displacement_;
};

}  // namespace hapticd::rt
