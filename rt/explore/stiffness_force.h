#pragma once

#include "hal/samples.h"
#include "rt/contribution/contact_state.h"
#include "rt/control/reaction_lead.h"
#include "rt/modulation/late_onset.h"
#include "rt/target/contact_release.h"
#include "rt/target/target_blend.h"

namespace hapticd::rt {

/// The force that makes an object feel like the target: what every other force is added to. Knows the loop's
/// delay, and comes in late where a contact's evidence does.
class StiffnessForce {
 public:
  struct Options {
    bool is_modulated = true;       ///< false: the object stays as it is
    bool keeps_friction = true;     ///< false: (4.4), friction cancelled
    bool needs_evidence = true;     ///< false: every contact is rendered in full at once
    bool fades_last_force = false;  ///< after a release, in place of the target at what is left
    double lead_s = 0.0;            ///< of the displacement, at least
    double delay_s = 0.0;           ///< of the loop
  };

  StiffnessForce(const Options& options, const TargetBlend& target,
                 const ReactionLead& reaction_lead) noexcept
      : options_(options), target_(target), reaction_lead_(reaction_lead) {}

  void set_target(const TargetLaw& target, double ramp_s) noexcept { target_.set(target, ramp_s); }
  double target_n_per_mm() const noexcept { return target_.stiffness_n_per_mm(); }

  /// Looks ahead by the loop's delay, and fills in `now.lead_s`. Returns the share, 0 … 1, of what may be
  /// compensated at the present target.
  double predict(ContactState& now) noexcept;
  /// Desired force, authority taken into account.
  hal::Vector3 update(const ContactState& now, ContactRelease& release) noexcept;
  /// Holds the sum of all desired forces within `max_n`; what is held back joins what comes late.
  void hold_within(double max_n, const ContactState& now, hal::Vector3& desired_n) noexcept;
  void reset() noexcept;
  /// Share of the target's force that is not missing since the contact began late, 0 … 1.
  double rendered_share() const noexcept { return late_.rendered_share(); }

 private:
  hal::Vector3 in_contact(const ContactState& now, ContactRelease& release) noexcept;

  Options options_;
  TargetBlend target_;
  LateOnset late_;
  ReactionLead reaction_lead_;
  double reaction_ahead_n_ = 0.0;  ///< of the normal force, beyond its present value
};

}  // namespace hapticd::rt
