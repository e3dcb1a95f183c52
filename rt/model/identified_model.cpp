#include "rt/model/identified_model.h"

#include <cmath>
#include <sstream>

namespace hapticd::rt {

namespace {

/// The first complaint of a row of ranges; NaN fails every one.
class Ranges {
 public:
  explicit Ranges(std::string where) : where_(std::move(where)) {}
  void expect(const std::string& key, double value, double low, double high) {
    if (error || (value >= low && value <= high)) return;
    std::ostringstream got;
    std::ostringstream limit;
    got << value;
    limit << low << " … " << high;
    error = hal::Error::of(hal::ErrorCode::kOutOfRange, key + " is out of range", where_, got.str(),
                           limit.str(), "identify it again");
  }
  void expect(const std::string& key, const hal::Vector3& value, double bound) {
    expect(key + ".x", value.x, -bound, bound);
    expect(key + ".y", value.y, -bound, bound);
    expect(key + ".z", value.z, -bound, bound);
  }
  const std::string& where() const { return where_; }
  std::optional<hal::Error> error;

 private:
  std::string where_;
};

struct ContentCheck {
  const IdentifiedModel& model;
  Ranges& ranges;

  void operator()(const ContactModel& contact) const {
    ObjectModel object;
    object.name = model.object;
    object.hunt_crossley = contact.hunt_crossley;
    object.creep = contact.creep;
    ranges.expect("number of laws", (contact.hunt_crossley ? 1 : 0) + (contact.creep ? 1 : 0), 1, 2);
    if (!ranges.error) ranges.error = check(object);
  }
  void operator()(const FrictionModel& model_of) const {
    const FrictionParameters& friction = model_of.friction;
    ranges.expect("kinetic", friction.kinetic, 0.0, 5.0);
    ranges.expect("presliding_mm", friction.presliding_mm, 0.0, 20.0);
    ranges.expect("viscous_n_s_per_mm", friction.viscous_n_s_per_mm, 0.0, 1.0);
    ranges.expect("exponent", friction.exponent, 0.0, 3.0);
    const bool elements_fit = model_of.tip == Tip::kRod || !friction.maxwell_slip;
    ranges.expect("Maxwell-slip elements of a ball bearing", elements_fit ? 0.0 : 1.0, 0.0, 0.0);
    if (!ranges.error) ranges.error = check_maxwell_slip(friction, "", ranges.where());
  }
  void operator()(const StructuralModel& structure) const {
    ranges.expect("stiffness_n_per_mm", structure.stiffness_n_per_mm, 0.05, 1e4);
    ranges.expect("centre_mm", structure.centre_mm, 1e3);
    ranges.expect("gradient_per_mm", structure.gradient_per_mm, 1.0);
    for (const double h : structure.curvature_per_mm2) ranges.expect("curvature_per_mm2", h, -1.0, 1.0);
    ranges.expect("covered_from_mm", structure.covered_from_mm, 1e3);
    ranges.expect("covered_to_mm", structure.covered_to_mm, 1e3);
  }
  void operator()(const ToolModel& tool) const {
    ranges.expect("mass_g", tool.mass_g, 0.0, 1e4);
    ranges.expect("centre_mm", tool.centre_mm, 1e3);
    ranges.expect("force_bias_n", tool.force_bias_n, 1e3);
    ranges.expect("torque_bias_n_mm", tool.torque_bias_n_mm, 1e5);
    const hal::Quaternion& q = tool.sensor_to_tool;
    if (tool.tip_to_centre_mm) ranges.expect("tip_to_centre_mm", *tool.tip_to_centre_mm, 1e3);
    ranges.expect("length of sensor_to_tool", std::sqrt(q.w * q.w + q.x * q.x + q.y * q.y + q.z * q.z),
                  1.0 - 1e-6, 1.0 + 1e-6);
  }
  void operator()(const ThresholdModel& threshold) const {
    ranges.expect("threshold_n", threshold.threshold_n, 1e-4, 10.0);
    ranges.expect("largest_residual_n", threshold.largest_residual_n, 0.0, 10.0);
    ranges.expect("observed_s", threshold.observed_s, 0.0, 1e6);
  }
  void operator()(const GainsModel& gains) const {
    ranges.expect("proportional_gain", gains.proportional_gain, 1e-3, 2.0);
    ranges.expect("derivative_ms", gains.derivative_ms, -1e3, 1e3);
    ranges.expect("ultimate_gain", gains.ultimate_gain, 1e-3, 2.0);
    ranges.expect("ultimate_period_ms", gains.ultimate_period_ms, 0.0, 1e5);
  }
  void operator()(const InclusionModel& inclusion) const {
    ranges.expect("place_mm", inclusion.place_mm, 1e3);
    ranges.expect("surface_mm", inclusion.surface_mm, 1e3);
    if (ranges.error) return;
    ranges.expect("max_displacement_mm", model.validity.max_displacement_mm, 0.5, 100.0);
    if (!ranges.error) {
      ranges.error =
          check(inclusion.rendered(model.validity.max_displacement_mm), "inclusion.", ranges.where());
    }
  }
};

}  // namespace

const char* kind_name(const ModelContent& content) noexcept {
  constexpr const char* kNames[] = {"contact", "friction", "structural_stiffness", "tool", "threshold",
                                    "gains",   "inclusion"};
  return kNames[content.index()];
}

FrictionParameters rendered_friction(const IdentifiedModel& model) {
  FrictionParameters friction = std::get<FrictionModel>(model.content).friction;
  for (const EstimatedParameter& p : model.parameters) {
    if (p.name != "presliding_mm" || !(p.value > 0.0)) continue;
    constexpr double kMostRelativeError = 10.0;
    friction.presliding_relative_error = std::min(p.standard_error / p.value, kMostRelativeError);
  }
  return friction;
}

bool is_of_object(const ModelContent& content) noexcept {
  return std::holds_alternative<ContactModel>(content) || std::holds_alternative<FrictionModel>(content) ||
         std::holds_alternative<InclusionModel>(content);
}

std::optional<hal::Error> check(const IdentifiedModel& model) {
  const std::string kind = kind_name(model.content);
  Ranges ranges(kind + " model" + (model.object.empty() ? "" : " of '" + model.object + "'"));
  std::visit(ContentCheck{model, ranges}, model.content);
  for (const EstimatedParameter& parameter : model.parameters) {
    if (!std::isfinite(parameter.value)) ranges.expect(parameter.name, parameter.value, -1e300, 1e300);
    ranges.expect("standard error of " + parameter.name, parameter.standard_error, 0.0, HUGE_VAL);
  }
  ranges.expect("max_displacement_mm", model.validity.max_displacement_mm, 0.0, 1e3);
  ranges.expect("max_speed_mm_per_s", model.validity.max_speed_mm_per_s, 0.0, 1e5);
  ranges.expect("max_force_n", model.validity.max_force_n, 0.0, 1e3);
  ranges.expect("residual", model.residual, 0.0, 1e3);
  return ranges.error;
}

}  // namespace hapticd::rt
