#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "server/identification/session/identification.h"
#include "server/identification/session/kinds.h"

namespace hapticd::identification {

/// Course of every identification: by the table of its kind it asks for motion, judges what an estimator
/// finds and finishes the model. A kind adds its estimator, and what its table cannot say.
class IdentificationSession : public Identification {
 public:
  MotionRequest next_request() const override;
  IdentificationProgress progress() const final;
  hal::Result<rt::IdentifiedModel> finish() const override;

 protected:
  explicit IdentificationSession(const Kind& kind) : kind_(kind) {}
  /// `samples_per_s`: how many samples visit() is called for.
  IdentificationSession(const Kind& kind, double samples_per_s);

  hal::Error refusal(std::string what, std::string value, std::string limit, std::string remedy) const;
  /// Counts a sample in the kind's plan of that number.
  void visit(std::size_t plan, double x, double y = 0.0) noexcept;

 private:
  /// Says what the estimator has found. Given are the kind's coverage, what is missing of it, and a residual
  /// of NaN; `converged` is to say whether all conditions but `steady` and `certain` are met, `completion`
  /// how far it is if it has not converged. Words on the axes are those of the kind.
  virtual void find(IdentificationProgress& progress) const = 0;
  /// Completes the model, which has the parameters, the residual and `converged` of the progress. An error if
  /// the data do not show it.
  virtual std::optional<hal::Error> conclude(const IdentificationProgress& now,
                                             rt::IdentifiedModel& model) const = 0;
  /// Number of the kind's motion that is to come.
  virtual std::size_t turn() const { return 0; }

  const Kind& kind_;
  std::vector<Coverage> coverage_;  ///< one per plan of the kind; without the share
  mutable double completion_ = 0.0;
};

}  // namespace hapticd::identification
