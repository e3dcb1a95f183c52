#include "rt/explore/explored_contact.h"

#include <algorithm>

#include "rt/signal/ticks.h"

namespace hapticd::rt {

namespace {

constexpr double kRegainS = 0.1;        // ringing after a bounce is over by then
constexpr double kSensorLateS = 0.005;  // at most, behind the encoders

}  // namespace

ExploredContact::ExploredContact(const ContactParameters& parameters, double tool_mass_g,
                                 const Direction& direction, const Displacement& displacement,
                                 double rate_hz) noexcept
    : parameters_(parameters),
      contact_(parameters, tool_mass_g, rate_hz),
      regain_ticks_(ticks_of(kRegainS, rate_hz)),
      direction_(direction),
      displacement_(displacement) {}

void ExploredContact::reset() noexcept {
  contact_.reset();
  pull_.reset();
  displacement_.reset();
}

void ExploredContact::update(const hal::RigSample& sample, ContactState& now) noexcept {
  detect(sample, now.tool);
  estimate(now);
  if (contact_.in_contact()) judge(now);
  now.in_contact = contact_.in_contact();
  now.earned_authority = contact_.earned_authority();
  now.begins_anew = contact_.begins();
}

inline void ExploredContact::detect(const hal::RigSample& sample, const ToolState& tool) noexcept {
  // If the reaction pushes, the tip is not above the surface, whatever the path says.
  const bool pushed = dot(tool.reaction_n, direction_.normal()) > parameters_.threshold_n;
  const double counted_mm = displacement_.displacement_mm();
  const ContactStage3::Input input{
      .interval = tool.interval,
      // Signed as the residual wants it: in free motion the load is -m a.
      .free_motion = {tool.load_n * -1.0, tool.mass_mm, sample.time_ns - sample.position_age_ns,
                      sample.time_ns - sample.force_mean_age_ns},
      .tip_mm = tool.tip_mm,
      .velocity_mm_per_s = tool.velocity_mm_per_s,
      .reaction_n = norm(tool.reaction_n),
      .depth_mm = pushed ? std::max(0.0, counted_mm) : counted_mm,
      .acceleration_mm_per_s2 = norm(tool.mass_acceleration_mm_per_s2)};
  contact_.detect(input);
  // After a bounce the tool may rest on the object without the detector knowing how deep. A law does.
  const bool pulls = is_pulled(tool, input.reaction_n);
  if (pulls && contact_.in_contact()) contact_.withdraw();
  regained_ = !pulls && displacement_.has_law() && contact_.detector().disturbed_ticks() >= regain_ticks_;
  if (regained_) contact_.declare(sample.time_ns - sample.position_age_ns);
}

inline bool ExploredContact::is_pulled(const ToolState& tool, double reaction_n) noexcept {
  if (!parameters_.evidence.required) return false;
  if (contact_.detector().is_free()) pull_.release();
  const double threshold_n = contact_.detector().threshold_n();
  if (reaction_n < threshold_n) return false;  // its direction is noise
  if (pull_.is_pull(tool.reaction_n, tool.tip_mm)) return true;
  const bool felt = contact_.authority() > 0.0 && reaction_n > 2.0 * threshold_n;
  const bool felt_unseen = contact_.detector().is_waiting() && reaction_n > contact_.max_free_force_n();
  if (felt || felt_unseen) pull_.remember(tool.reaction_n, tool.tip_mm);
  return false;
}

inline void ExploredContact::estimate(ContactState& now) noexcept {
  const ToolState& tool = now.tool;
  const hal::Vector3 normal_before = direction_.normal();
  const double inward_mm = -dot(tool.step_mm, normal_before);
  const bool in_contact = contact_.in_contact();
  now.began = in_contact && contact_.detector().just_declared();
  if (now.began) {
    begin(tool);
  } else if (in_contact) {
    direction_.update(tool.reaction_n, tool.step_mm, tool.velocity_mm_per_s, tool.interval.periods);
  }
  now.normal = direction_.normal();
  now.rate_mm_per_s = -dot(tool.velocity_mm_per_s, now.normal);
  if (!in_contact) {
    const double unexplained_n = contact_.detector().disturbed_ticks() > 0 ? norm(tool.reaction_n) : 0.0;
    return displacement_.rest(inward_mm, unexplained_n, tool.interval);
  }
  now.friction_n = direction_.friction_n();
  now.normal_n = dot(tool.reaction_n, now.normal);
  if (now.began) return;
  const double by_law_mm = displacement_.by_law().displacement_mm;
  const hal::Vector3 slide_mm = across(tool.step_mm, normal_before);
  displacement_.update(tool.tip_mm, inward_mm, slide_mm, now.normal, now.normal_n, now.rate_mm_per_s,
                       tool.interval);
  path_mm_ = std::max(0.0, path_mm_ + inward_mm);
  path_check_.update(inward_mm, norm(slide_mm), displacement_.by_law().displacement_mm - by_law_mm);
}

inline void ExploredContact::begin(const ToolState& tool) noexcept {
  direction_.begin(tool.reaction_n);
  path_mm_ = 0.0;
  path_check_.begin();
  if (regained_) return displacement_.begin_unseen(tool.tip_mm, norm(tool.reaction_n));
  const double below_threshold_n = parameters_.release_ratio * parameters_.threshold_n;
  const bool looks_back = parameters_.method == ContactMethod::kMatchedInertia;
  displacement_.begin(looks_back ? contact_.onset_mm() : tool.tip_mm, tool.tip_mm, direction_.normal(),
                      below_threshold_n);
}

inline void ExploredContact::judge(const ContactState& now) noexcept {
  const ToolState& tool = now.tool;
  const double deflection_mm = norm(tool.encoder_mm - tool.tip_mm);
  contact_.judge({now.normal_n, displacement_.displacement_mm(), path_mm_, norm(tool.acceleration_mm_per_s2),
                  -dot(tool.acceleration_mm_per_s2, now.normal), deflection_mm},
                 tool.interval);
  if (!parameters_.evidence.required || !displacement_.has_law() || !path_check_.is_contradicted(0.0)) return;
  const double uncertain_mm =
      ContactEvidence::kDeflectionError * deflection_mm + kSensorLateS * norm(tool.velocity_mm_per_s);
  if (path_check_.is_contradicted(uncertain_mm)) contact_.await_free();
}

void ExploredContact::fill_record(const ContactState& now, TickRecord& record) const noexcept {
  record.reaction_force_n = now.normal_n;
  record.reaction_n = now.tool.reaction_n;
  if (!now.in_contact) {
    record.normal = record.friction_force_n = {};
    record.sliding_mm_per_s = record.displacement_mm = 0.0;
    record.law_displacement_mm = record.displacement_deviation_mm = 0.0;
    return;
  }
  record.normal = now.normal;
  record.friction_force_n = now.friction_n;
  record.sliding_mm_per_s = norm(across(now.tool.velocity_mm_per_s, now.normal));
  record.displacement_mm = now.displacement_mm;
  record.law_displacement_mm = displacement_.by_law().displacement_mm;
  record.displacement_deviation_mm = displacement_.deviation_mm();
}

}  // namespace hapticd::rt
