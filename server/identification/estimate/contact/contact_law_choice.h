#pragma once

#include <cstdint>
#include <optional>

#include "server/identification/estimate/contact/contact_creep_fit.h"
#include "server/identification/estimate/held_out_error.h"

namespace hapticd::identification {

/// Form of law for the elastic part of an object, the simpler first.
enum class ContactLawForm : std::uint8_t {
  kPower,         ///< Hunt-Crossley's K x^m (4.22): three numbers
  kElasticCurve,  ///< a free increasing curve x = Ψ(f) that answers at once: a creep law with w_0 = 1
  kCreep,         ///< the same curve of a force that creeps
};

/// Forms that an object's palpation supports.
struct ContactLawChoice {
  ContactLawForm form = ContactLawForm::kCreep;
  HeldOutError power, elastic_curve, creep;
  /// True if the palpation determines how much creeps; one slow loading does not, whatever it leaves.
  bool creep_is_determined = false;

  /// Curve that the data ask for, whatever the power law is worth: creep if it pays and is determined, or
  /// leaves less than half.
  ContactLawForm curve() const noexcept;
  /// True if the power law is off by more than a hand can feel (kNoticeable), and a curve is better: it must
  /// not be rendered with.
  bool power_is_unfit() const noexcept;

  /// Just noticeable relative difference of stiffness (Jones and Hunter 1990).
  static constexpr double kNoticeable = 0.23;
};

/// Judges each form on the displacement that it makes of the force, which is what a scene uses it for, over
/// samples that were held out of its fit. The simpler form is kept unless a richer one is better by more than
/// the richer one's standard error (the one-standard-error rule of Breiman et al. 1984). `surface_mm` and
/// `fewest_samples` as in CreepFit::Options; `offset_mm`: the power law's surface may lie that far before or
/// behind. None if no form can be fitted.
std::optional<ContactLawChoice> choose_contact_law(const CreepFit& palpation, double surface_mm,
                                                   double offset_mm, std::size_t fewest_samples);

}  // namespace hapticd::identification
