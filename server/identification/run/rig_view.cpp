#include "server/identification/run/rig_view.h"

#include <fmt/format.h>

#include "rt/signal/vector.h"

namespace hapticd::server {

RigView::Needs RigView::needs_of(const IdentificationTask& task) noexcept {
  // An inclusion's place is found in the rig's frame.
  if (std::holds_alternative<identification::InclusionTask>(task)) return Needs::kSeated;
  if (is_about_object(task)) return Needs::kUpright;
  return std::holds_alternative<identification::ThresholdTask>(task) ? Needs::kSeated : Needs::kRaw;
}

RigView::RigView(const IdentificationTask& task, const identification::PressGeometry& geometry,
                 const hal::RigInfo& rig, const RigModels& models, const ZeroInForce& zero)
    : needs_(needs_of(task)), rig_(rig) {
  if (needs_ == Needs::kRaw) return;
  const hal::Vector3 gravity = zero.gravity.value_or(hal::Vector3{0.0, 0.0, -1.0});
  rt::ToolLoad load(rig_.sensor.tool_mass_g, gravity);
  if (models.tool) {
    const auto& tool = std::get<rt::ToolModel>(models.tool->model.content);
    const rt::SensorMounting mounting = mounting_of(tool, gravity, zero);
    rig_.sensor.tool_mass_g = tool.mass_g;
    load = rt::ToolLoad::mounted(tool.mass_g, mounting);
    remark_ = fmt::format("the tool of stored model {}: {:.4g} g, the sensor turned by {:.2g}°",
                          models.tool->short_hash(), tool.mass_g, rt::norm(mounting.turn_deg));
  }
  frame_.emplace(geometry, load, rig_.sensor.tool_mass_g, rig_);
}

rt::Observation RigView::see(const rt::Observation& observation) noexcept {
  if (!frame_) return observation;
  frame_->follow_zero(observation.sample);
  return needs_ == Needs::kUpright ? frame_->upright(observation) : frame_->seated(observation);
}

}  // namespace hapticd::server
