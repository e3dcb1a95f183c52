#include "server/model/store/model_diff.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace hapticd::server {

namespace {

const rt::EstimatedParameter* find(const rt::IdentifiedModel& model, const std::string& name) {
  const auto found = std::find_if(model.parameters.begin(), model.parameters.end(),
                                  [&name](const auto& parameter) { return parameter.name == name; });
  return found == model.parameters.end() ? nullptr : &*found;
}

ParameterDifference compare(const rt::EstimatedParameter* a, const rt::EstimatedParameter* b) {
  ParameterDifference result;
  result.name = (a != nullptr ? a : b)->name;
  result.unit = (a != nullptr ? a : b)->unit;
  if (a != nullptr) result.value_a = a->value;
  if (b != nullptr) result.value_b = b->value;
  // In different units they cannot be compared.
  if (a == nullptr || b == nullptr || a->unit != b->unit) return result;
  const double apart = b->value - a->value;
  if (a->value != 0.0) result.relative = apart / a->value;
  const double deviation = std::hypot(a->standard_error, b->standard_error);
  if (deviation > 0.0 && std::isfinite(deviation)) result.deviations = std::abs(apart) / deviation;
  return result;
}

std::string tip_of(const rt::IdentifiedModel& model) {
  const auto* friction = std::get_if<rt::FrictionModel>(&model.content);
  if (friction == nullptr) return {};
  return friction->tip == rt::Tip::kRod ? "rod" : "ball_bearing";
}

}  // namespace

Outcome<ModelDifference> difference(const StoredModel& a, const StoredModel& b) {
  const std::string kind_a = rt::kind_name(a.model.content);
  const std::string kind_b = rt::kind_name(b.model.content);
  if (kind_a != kind_b) {
    return Refusal{RefusalKind::kInvalidArgument,
                   {"models of different kinds have nothing to compare", "hash_b", kind_b, kind_a,
                    "name two models of one kind"}};
  }
  ModelDifference result;
  for (const rt::EstimatedParameter& parameter : a.model.parameters) {
    result.parameters.push_back(compare(&parameter, find(b.model, parameter.name)));
  }
  for (const rt::EstimatedParameter& parameter : b.model.parameters) {
    if (const auto* other = find(a.model, parameter.name); other == nullptr) {
      result.parameters.push_back(compare(nullptr, &parameter));
    } else if (other->unit != parameter.unit) {
      result.remarks.push_back(
          fmt::format("unit of {}: {} against {}", parameter.name, other->unit, parameter.unit));
    }
  }
  const auto reported = [&](const char* what, const std::string& of_a, const std::string& of_b) {
    if (of_a != of_b) result.remarks.push_back(fmt::format("{}: '{}' against '{}'", what, of_a, of_b));
  };
  const auto number = [&](const char* what, double of_a, double of_b) {
    if (of_a != of_b) result.remarks.push_back(fmt::format("{}: {:.4g} against {:.4g}", what, of_a, of_b));
  };
  reported("object", a.model.object, b.model.object);
  reported("tip", tip_of(a.model), tip_of(b.model));
  reported("device", a.model.device, b.model.device);
  reported("sensor", a.model.sensor, b.model.sensor);
  reported("procedure", a.model.procedure, b.model.procedure);
  reported("data", a.model.data_reference, b.model.data_reference);
  number("covered displacement [mm]", a.model.validity.max_displacement_mm,
         b.model.validity.max_displacement_mm);
  number("covered speed [mm/s]", a.model.validity.max_speed_mm_per_s, b.model.validity.max_speed_mm_per_s);
  number("covered force [N]", a.model.validity.max_force_n, b.model.validity.max_force_n);
  number("residual", a.model.residual, b.model.residual);
  if (a.model.converged != b.model.converged) {
    result.remarks.push_back(a.model.converged ? "only the first had converged"
                                               : "only the second had converged");
  }
  return result;
}

}  // namespace hapticd::server
