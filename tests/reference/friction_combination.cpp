#include "tests/reference/friction_combination.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace hapticd::identification {

namespace {

hal::Error cannot_combine(const std::string& what, const std::string& value, const std::string& limit,
                          const std::string& remedy) {
  return {what, "combination of friction models", value, limit, remedy};
}

struct Mean {
  double value = 0.0;
  double error = std::numeric_limits<double>::infinity();
  double spread = 0.0;
  bool reported = false;
};

/// Mean of the objects that show the parameter at all.
Mean mean_of(const std::vector<rt::IdentifiedModel>& models, const std::string& name) {
  std::vector<double> values;
  std::vector<double> variances;
  for (const rt::IdentifiedModel& model : models) {
    for (const rt::EstimatedParameter& p : model.parameters) {
      if (p.name != name || !std::isfinite(p.value) || !std::isfinite(p.standard_error)) continue;
      values.push_back(p.value);
      // A standard error of zero would outvote everything: nothing is known better than to a thousandth.
      const double error = std::max(p.standard_error, 1e-3 * std::abs(p.value) + 1e-12);
      variances.push_back(error * error);
    }
  }
  Mean mean;
  if (values.empty()) return mean;
  mean.reported = true;
  double between = 0.0;
  for (const bool final_pass : {false, true}) {
    double w = 0.0, wx = 0.0, ww = 0.0, q = 0.0;
    for (std::size_t i = 0; i < values.size(); ++i) {
      const double weight = 1.0 / (variances[i] + between);
      w += weight;
      ww += weight * weight;
      wx += weight * values[i];
    }
    mean.value = wx / w;
    mean.error = std::sqrt(1.0 / w);
    if (final_pass) break;
    for (std::size_t i = 0; i < values.size(); ++i) {
      q += (values[i] - mean.value) * (values[i] - mean.value) / variances[i];
    }
    const double excess = w - ww / w;
    if (excess > 0.0) between = std::max(0.0, (q - static_cast<double>(values.size() - 1)) / excess);
  }
  mean.spread = std::sqrt(between);
  return mean;
}

}  // namespace

hal::Result<rt::IdentifiedModel> combine_friction(const std::vector<rt::IdentifiedModel>& models) {
  if (models.size() < 2) {
    return cannot_combine("too few models", std::to_string(models.size()), "at least 2",
                          "identify more objects");
  }
  rt::IdentifiedModel combined;
  rt::FrictionModel content;
  bool first = true;
  combined.converged = true;
  double residual_squared = 0.0;
  for (const rt::IdentifiedModel& model : models) {
    const auto* friction = std::get_if<rt::FrictionModel>(&model.content);
    if (friction == nullptr) {
      return cannot_combine("not a friction model", rt::kind_name(model.content), "friction models",
                            "leave it out");
    }
    if (!first && friction->tip != content.tip) {
      return cannot_combine("the models are of different tips", "rod and ball bearing", "one tip",
                            "combine the models of each tip by themselves");
    }
    content.tip = friction->tip;
    combined.object += (first ? "" : "+") + model.object;
    combined.data_reference += (first ? "" : "; ") + model.data_reference;
    combined.device = first || combined.device == model.device ? model.device : "several";
    combined.sensor = first || combined.sensor == model.sensor ? model.sensor : "several";
    combined.converged = combined.converged && model.converged;
    residual_squared += model.residual * model.residual;
    const rt::ValidityRange& v = model.validity;
    rt::ValidityRange& c = combined.validity;
    c.max_force_n = first ? v.max_force_n : std::min(c.max_force_n, v.max_force_n);
    c.max_speed_mm_per_s =
        first ? v.max_speed_mm_per_s : std::min(c.max_speed_mm_per_s, v.max_speed_mm_per_s);
    c.max_displacement_mm =
        first ? v.max_displacement_mm : std::min(c.max_displacement_mm, v.max_displacement_mm);
    if (first) content.friction = friction->friction;
    content.friction.maxwell_slip.reset();  // elements of different objects have no mean: Dahl's law has
    first = false;
  }
  struct Part {
    const char* name;
    const char* unit;
    double* value;
  };
  rt::FrictionParameters& f = content.friction;
  for (const Part& part :
       {Part{"kinetic", "1", &f.kinetic}, Part{"presliding_mm", "mm", &f.presliding_mm},
        Part{"viscous_n_s_per_mm", "N·s/mm", &f.viscous_n_s_per_mm}, Part{"exponent", "1", &f.exponent}}) {
    const Mean mean = mean_of(models, part.name);
    if (!mean.reported) {
      const std::string name = part.name;
      if (name == "kinetic")
        return cannot_combine("no object shows the level of friction", "", "", "stroke for longer");
      continue;  // assumed, or the default
    }
    *part.value = mean.value;
    combined.parameters.push_back({part.name, part.unit, mean.value, mean.error});
    combined.parameters.push_back({std::string(part.name) + "_spread", part.unit, mean.spread, 0.0});
  }
  f.viscous_n_s_per_mm = std::max(0.0, f.viscous_n_s_per_mm);
  combined.content = content;
  combined.residual = std::sqrt(residual_squared / static_cast<double>(models.size()));
  combined.procedure = "mean over " + std::to_string(models.size()) +
                       " objects, weighted by standard errors and the spread between objects";
  return combined;
}

}  // namespace hapticd::identification
