#include "server/identification/session/contact/contact_words.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <string>

#include "server/identification/session/contact/contact_state.h"

namespace hapticd::identification {

const char* words_of(ContactFitMethod method) {
  switch (method) {
    case ContactFitMethod::kRecursive:
      return "gated single-stage log-linear recursive least squares";
    case ContactFitMethod::kBatch:
      return "variable projection";
    case ContactFitMethod::kRecursiveThenBatch:
      break;
  }
  return "recursive least squares, then variable projection";
}

std::string words_of(const ContactLawChoice& choice) {
  const auto percent = [](const HeldOutError& error) {
    char text[40];
    std::snprintf(text, sizeof text, "%.2g %%", 100.0 * error.relative);
    return std::string(std::isfinite(error.relative) ? text : "no fit");
  };
  std::string words = "; displacement held out of the fit is missed by: power law " + percent(choice.power) +
                      ", elastic curve " + percent(choice.elastic_curve) + ", creep " +
                      percent(choice.creep) + "; chosen: ";
  switch (choice.form) {
    case ContactLawForm::kPower:
      words += "power law";
      break;
    case ContactLawForm::kElasticCurve:
      words += "elastic curve";
      break;
    case ContactLawForm::kCreep:
      words += "creep";
      break;
  }
  if (choice.power_is_unfit()) words += "; the power law is left out: more than a hand can feel is missing";
  return words;
}

std::string words_of_unseen(const CreepEstimate& creep) {
  const auto& times_s = creep.law.parameters.time_s;
  double longest_s = 0.0;
  bool unseen = false;
  for (std::size_t l = 0; l < times_s.size(); ++l) {
    unseen = unseen || !creep.lag_determined[l];
    if (creep.lag_determined[l]) longest_s = std::max(longest_s, times_s[l]);
  }
  if (!unseen) return {};
  char text[120];
  std::snprintf(text, sizeof text,
                "; what creeps over more than %.2g s is not known: no press was held that long", longest_s);
  return text;
}

void ContactIdentification::State::list_parameters(const Fit& current,
                                                   const std::optional<HuntCrossleyEstimate>& law,
                                                   const HuntCrossleyUncertainty& u,
                                                   const std::optional<CreepEstimate>& creep_found,
                                                   std::vector<rt::EstimatedParameter>& parameters) const {
  if (recorded && current.surface) {
    const double offset = law ? law->contact_offset_mm : 0.0;
    const bool searched = law && std::isfinite(u.contact_offset_mm) && u.contact_offset_mm > 0.0;
    parameters.push_back({"contact_point_mm", "mm", current.surface->surface_mm - offset,
                          searched ? u.contact_offset_mm : current.surface->standard_error_mm});
  }
  if (wants_hunt_crossley() && law) {
    const rt::HuntCrossleyParameters& p = law->parameters;
    parameters.push_back({"stiffness_n_per_mm_m", "N/mm^m", p.stiffness_n_per_mm_m, u.stiffness_n_per_mm_m});
    parameters.push_back(
        {"damping_n_s_per_mm_m1", "N s/mm^(m+1)", p.damping_n_s_per_mm_m1, u.damping_n_s_per_mm_m1});
    parameters.push_back({"exponent", "1", p.exponent, u.exponent});
  }
  if (wants_creep() && creep_found) {
    if (recorded && current.surface) {
      parameters.push_back(
          {"curve_surface_mm", "mm", current.surface->surface_mm, current.surface->standard_error_mm});
    }
    const rt::CreepParameters& p = creep_found->law.parameters;
    for (std::size_t j = 0; j < p.weight.size(); ++j) {
      parameters.push_back({"weight_" + std::to_string(j), "1", p.weight[j], creep_found->weight_error[j]});
    }
    const double x = p.displacement_mm.back();
    parameters.push_back({"displacement_mm", "mm", x, creep_found->relative_displacement * x});
  }
}

}  // namespace hapticd::identification
