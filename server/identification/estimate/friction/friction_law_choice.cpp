#include "server/identification/estimate/friction/friction_law_choice.h"

#include <cmath>
#include <cstddef>

namespace hapticd::identification {

namespace {

constexpr int kPassagesPerBlock = 2;  // a stroke and the way back

bool is_held_out(const FrictionRow& row, int fold) {
  return row.passage / kPassagesPerBlock % static_cast<int>(HeldOutBlocks::kFolds) == fold;
}

void judge(HeldOutTrial& trial, const std::vector<FrictionRow>& rows, const std::vector<double>& predicted_n,
           double bias_n, int fold, double min_speed_mm_per_s) {
  SquaredError squares;
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const FrictionRow& row = rows[i];
    if (!row.settled || !is_held_out(row, fold) || std::abs(row.speed_mm_per_s) < min_speed_mm_per_s)
      continue;
    squares.add(predicted_n[i] - bias_n, row.friction_n - bias_n, row.weight);
  }
  trial.add(squares);
}

}  // namespace

MaxwellSlipFitOptions maxwell_slip_options(const FrictionFitOptions& options) noexcept {
  // If a viscous part is in doubt a law without one is the simpler.
  return {options.bias, options.viscous && !options.doubt_viscous, options.min_speed_mm_per_s};
}

FrictionForm FrictionLawChoice::form() const noexcept {
  const bool exponent_pays = pays(dahl_exponent, dahl);
  if (pays(maxwell_slip, exponent_pays ? dahl_exponent : dahl)) return FrictionForm::kMaxwellSlip;
  return exponent_pays ? FrictionForm::kDahlExponent : FrictionForm::kDahl;
}

FrictionLawChoice choose_friction_law(const std::vector<FrictionRow>& rows, FrictionFitOptions options) {
  HeldOutTrial dahl, dahl_exponent, maxwell_slip;
  for (int fold = 0; fold < static_cast<int>(HeldOutBlocks::kFolds); ++fold) {
    // Rows without weight: the state goes on through them, the fit does not see them.
    std::vector<FrictionRow> training = rows;
    for (FrictionRow& row : training) {
      if (is_held_out(row, fold)) row.weight = 0.0;
    }
    for (const bool exponent : {false, true}) {
      options.exponent = exponent;
      HeldOutTrial& trial = exponent ? dahl_exponent : dahl;
      const auto fit = fit_friction_law(training, options);
      if (!fit) {
        trial.fail();
        continue;
      }
      judge(trial, rows, predicted_friction_n(rows, fit->parameters, options.law, fit->bias_n), fit->bias_n,
            fold, options.min_speed_mm_per_s);
    }
    const auto fit = fit_maxwell_slip(training, maxwell_slip_options(options));
    if (!fit) {
      maxwell_slip.fail();
      continue;
    }
    judge(maxwell_slip, rows, predicted_friction_n(rows, *fit), fit->bias_n, fold,
          options.min_speed_mm_per_s);
  }
  return {dahl.error(), dahl_exponent.error(), maxwell_slip.error()};
}

}  // namespace hapticd::identification
