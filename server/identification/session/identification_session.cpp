#include "server/identification/session/identification_session.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace hapticd::identification {

IdentificationSession::IdentificationSession(const Kind& kind, double samples_per_s) : kind_(kind) {
  for (const CoveragePlan& plan : kind.coverage) {
    Coverage& coverage = coverage_.emplace_back(plan.x, plan.y);
    coverage.enough_samples = static_cast<std::uint32_t>(std::ceil(plan.enough_s * samples_per_s));
    for (const RequiredCell& cell : plan.required) coverage.required[coverage.cell(cell.x, cell.y)] = 1;
  }
}

void IdentificationSession::visit(std::size_t plan, double x, double y) noexcept {
  Coverage& coverage = coverage_[plan];
  std::uint32_t& count = coverage.counts[coverage.cell_at(x, y)];
  if (count < std::numeric_limits<std::uint32_t>::max()) ++count;
}

hal::Error IdentificationSession::refusal(std::string what, std::string value, std::string limit,
                                          std::string remedy) const {
  return {std::move(what), kind_.place, std::move(value), std::move(limit), std::move(remedy)};
}

MotionRequest IdentificationSession::next_request() const {
  if (kind_.motions.empty() || progress().converged) return {};
  return kind_.motions[turn() % kind_.motions.size()];
}

IdentificationProgress IdentificationSession::progress() const {
  IdentificationProgress progress;
  progress.residual = std::numeric_limits<double>::quiet_NaN();
  progress.fit_x = kind_.fit_x;
  progress.fit_y = kind_.fit_y;
  progress.coverage = coverage_;
  for (std::size_t plan = 0; plan < coverage_.size(); ++plan) {
    Coverage& coverage = progress.coverage[plan];
    coverage.update_share();
    for (const RequiredCell& cell : kind_.coverage[plan].required) {
      if (!coverage.has_enough(coverage.cell(cell.x, cell.y))) progress.missing.emplace_back(cell.words);
    }
  }
  find(progress);
  progress.converged = progress.converged && progress.certain && progress.steady;
  if (progress.converged) progress.missing.clear();
  completion_ = std::max(completion_, progress.converged ? 1.0 : progress.completion);
  progress.completion = completion_;
  return progress;
}

hal::Result<rt::IdentifiedModel> IdentificationSession::finish() const {
  const IdentificationProgress now = progress();
  rt::IdentifiedModel model;
  model.parameters = now.parameters;
  model.residual = std::isfinite(now.residual) ? now.residual : 0.0;
  model.converged = now.converged;
  if (auto error = conclude(now, model)) return *error;
  if (auto error = rt::check(model)) {
    if (kind_.remedy_of_bad_model != nullptr) error->remedy = kind_.remedy_of_bad_model;
    return *error;
  }
  return model;
}

}  // namespace hapticd::identification
