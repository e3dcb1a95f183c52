#include "server/identification/estimate/contact/contact_law_choice.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "rt/deformation/hunt_crossley.h"
#include "server/identification/estimate/contact/contact_variable_projection.h"

namespace hapticd::identification {

namespace {

constexpr std::size_t kRows = 1500;  // of a quick look, spread evenly

/// Rows of a palpation, thinned; displacement from the surface.
class Rows {
 public:
  Rows(const CreepFit& palpation, double surface_mm)
      : all_(palpation.rows()), surface_mm_(surface_mm), every_(all_.size() / kRows + 1) {
    for (const CreepFit::Row& row : all_)
      deepest_mm_ = std::max(deepest_mm_, row.displacement_mm - surface_mm);
  }
  /// `use(row, displacement_mm)` for those that are in the held-out blocks or not, beyond a hundredth of the
  /// deepest.
  template <class Use>
  void each(const HeldOutBlocks& blocks, bool held_out, const Use& use) const {
    for (std::size_t i = 0; i < all_.size(); i += every_) {
      const double x = all_[i].displacement_mm - surface_mm_;
      if (x < 0.01 * deepest_mm_ || blocks.contains(i, all_.size()) != held_out) continue;
      use(all_[i], x);
    }
  }

 private:
  std::span<const CreepFit::Row> all_;
  double surface_mm_;
  std::size_t every_;
  double deepest_mm_ = 0.0;
};

std::optional<SquaredError> judge_power(const Rows& rows, const HeldOutBlocks& blocks, double offset_mm,
                                        std::size_t fewest_samples) {
  std::vector<PalpationSample> training;
  rows.each(blocks, false, [&](const CreepFit::Row& row, double x) {
    training.push_back({x, row.rate_mm_per_s, row.force_n[0], true, row.time_s});
  });
  VariableProjectionOptions options;
  options.min_offset_mm = -offset_mm;
  options.max_offset_mm = offset_mm;
  options.fewest_samples = fewest_samples;
  const auto found = fit_by_variable_projection(training, options);
  if (!found) return std::nullopt;
  SquaredError squares;
  rows.each(blocks, true, [&](const CreepFit::Row& row, double x) {
    const rt::LawEstimate estimate =
        rt::hunt_crossley_displacement(found->parameters, row.force_n[0], row.rate_mm_per_s);
    squares.add(estimate.displacement_mm, x + found->contact_offset_mm);
  });
  return squares;
}

std::optional<SquaredError> judge_curve(const CreepFit& palpation, const Rows& rows,
                                        CreepFit::Options options, bool elastic) {
  options.elastic = elastic;
  const auto found = palpation.solve(options);
  if (!found) return std::nullopt;
  const rt::CreepParameters& parameters = found->law.parameters;
  const rt::CreepLaw law(parameters, 1000.0);
  SquaredError squares;
  rows.each(options.held_out, true, [&](const CreepFit::Row& row, double x) {
    double effective_n = 0.0;
    for (std::size_t j = 0; j < row.force_n.size(); ++j) effective_n += parameters.weight[j] * row.force_n[j];
    squares.add(law.curve(effective_n).displacement_mm, x);
  });
  return squares;
}

bool identifies_creep(const CreepFit& palpation, double surface_mm, std::size_t fewest_samples) {
  constexpr double kCertainWeight = 0.1;
  CreepFit::Options options;
  options.surface_mm = surface_mm;
  options.fewest_samples = fewest_samples;
  options.max_rows = kRows;
  const auto found = palpation.solve(options);
  // What yields at once and what within the shortest lag look alike, and it does not matter.
  return found &&
         *std::max_element(found->weight_error.begin() + 2, found->weight_error.end()) < kCertainWeight;
}

}  // namespace

ContactLawForm ContactLawChoice::curve() const noexcept {
  const bool enough = creep_is_determined || creep.relative < 0.5 * elastic_curve.relative;
  return enough && pays(creep, elastic_curve) ? ContactLawForm::kCreep : ContactLawForm::kElasticCurve;
}

bool ContactLawChoice::power_is_unfit() const noexcept {
  return form != ContactLawForm::kPower && power.relative > kNoticeable;
}

std::optional<ContactLawChoice> choose_contact_law(const CreepFit& palpation, double surface_mm,
                                                   double offset_mm, std::size_t fewest_samples) {
  const Rows rows(palpation, surface_mm);
  HeldOutTrial power, elastic, creep;
  for (HeldOutBlocks blocks{0}; blocks.fold < HeldOutBlocks::kFolds; ++blocks.fold) {
    CreepFit::Options options;
    options.surface_mm = surface_mm;
    options.fewest_samples = fewest_samples;
    options.max_rows = kRows;
    options.with_errors = false;
    options.held_out = blocks;
    const auto take = [](HeldOutTrial& trial, const std::optional<SquaredError>& fold) {
      fold ? trial.add(*fold) : trial.fail();
    };
    take(power, judge_power(rows, blocks, offset_mm, fewest_samples));
    take(elastic, judge_curve(palpation, rows, options, true));
    take(creep, judge_curve(palpation, rows, options, false));
  }
  ContactLawChoice choice;
  choice.power = power.error();
  choice.elastic_curve = elastic.error();
  choice.creep = creep.error();
  choice.creep_is_determined = identifies_creep(palpation, surface_mm, fewest_samples);
  const HeldOutError& curve = choice.curve() == ContactLawForm::kCreep ? choice.creep : choice.elastic_curve;
  if (!std::isfinite(curve.relative) && !std::isfinite(choice.power.relative)) return std::nullopt;
  choice.form = pays(curve, choice.power) ? choice.curve() : ContactLawForm::kPower;
  return choice;
}

}  // namespace hapticd::identification
