#pragma once

#include <memory>
#include <optional>

#include "hal/rig.h"
#include "server/identification/session/identification_session.h"
#include "server/identification/session/tasks.h"

namespace hapticd::identification {

/// Contact dynamics of an object from pressing it and letting go on one spot (D§4.5.1): the Hunt-Crossley law
/// (4.22) and the creep law. On a rig it is fed live and asks for what is missing; from a recording it
/// takes what there is, and also estimates where the surface lies, which a recording seldom shows.
///
/// The identification is "steady" when what the recursive estimate predicts and its exponent change by less
/// than 3 % per second of contact (D§4.5.1). It is "certain" when standard errors of the predicted force are
/// within 5 %, or within what the law itself leaves unexplained, of the exponent within 0.15, and of the
/// shares that creep within 0.1.
///
/// Refuses, each with a remedy: no contact, fewer samples than show anything, force or position of the
/// wrong sign, a signal that never changes, stiffness or range that no object has (units). Gaps, samples that
/// are not finite and a saturated sensor only degrade the result, and are given in the remarks.
///
/// Memory is a few megabytes at most however long it lasts; add() takes about a microsecond. progress() fits
/// again when there is enough new (some milliseconds, more for the creep law).
class ContactIdentification final : public IdentificationSession {
 public:
  ContactIdentification(const ContactTask& task, const hal::RigInfo& rig);
  ~ContactIdentification() override;

  void add(const rt::Observation& observation) override;
  MotionRequest next_request() const override;

 private:
  void find(IdentificationProgress& progress) const override;
  std::optional<hal::Error> conclude(const IdentificationProgress& now,
                                     rt::IdentifiedModel& model) const override;
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace hapticd::identification
