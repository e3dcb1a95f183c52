#include <algorithm>
#include <cmath>
#include <variant>

#include "hal/sim/base/rotation.h"
#include "hal/sim/simulation.h"

namespace hapticd::sim {

// Pressing straight down while moving sideways would jam the tip against the flank of anything curved. A hand
// whose stroke lies beyond the object's edge has nothing to go along.
void Simulation::follow_contour(HandIntent& intent) noexcept {
  const Vector3 meant_mm = intent.position_mm;
  const ObjectPose& pose = object_->pose;
  if (pose.displaced() && pose.share_at(pose.to_object(hand_->program.place_mm)) <= 0.0) return;
  Vector3 above{intent.position_mm.x, intent.position_mm.y, 0.0};
  if (pose.displaced()) above = pose.to_object(above);
  Projection surface = project(object_->model.shape, above);
  if (pose.displaced()) {
    surface.point_mm = pose.to_rig(surface.point_mm);
    surface.outward_normal = pose.direction_to_rig(surface.outward_normal);
  }
  const Vector3& n = surface.outward_normal;
  const Vector3 along{intent.velocity_mm_per_s.x, intent.velocity_mm_per_s.y, 0.0};
  intent.velocity_mm_per_s = along - n * dot(along, n) + n * intent.velocity_mm_per_s.z;
  intent.position_mm = surface.point_mm + n * intent.position_mm.z;
  contour_normal_ = n;
  // Away from its usual home the surface lies higher or lower than where the motion counts from: what the
  // hand meant so far turns into what it means along the contour without a jump.
  if (is_zero(hand_->program.place_mm)) return;
  if (!followed_contour_) {
    followed_contour_ = true;
    contour_offset_mm_ = meant_mm - intent.position_mm;
    contour_began_step_ = steps_;
  }
  constexpr double kFadeS = 0.3;
  const double since_s = static_cast<double>(steps_ - contour_began_step_) * step_s_;
  if (since_s >= kFadeS) return;
  const MotionState left = MinimumJerk({1.0, 0.0, 0.0}, {}, kFadeS).at(since_s);
  intent.position_mm = intent.position_mm + contour_offset_mm_ * left.position_mm;
  intent.velocity_mm_per_s = intent.velocity_mm_per_s + contour_offset_mm_ * left.velocity_mm_per_s;
}

Vector3 Simulation::press_phantom(const Vector3& free_mm, double compliance_mm_per_n,
                                  const Projection& nearest, Material::Step& step) noexcept {
  const ObjectPose& pose = object_->pose;
  constexpr Vector3 kFarAwayMm{0.0, 0.0, 1e3};
  const Vector3 seen_mm = pose.displaced() ? pose.to_object(free_mm) : free_mm;
  const bool there = !pose.displaced() || pose.share_at(seen_mm) > 0.0;
  const PhantomBody::Step pressed =
      object_->phantom->advance(there ? seen_mm : kFarAwayMm, compliance_mm_per_n);
  const Vector3 force_n = pose.displaced() ? pose.direction_to_rig(pressed.force_n) : pressed.force_n;
  step = {dot(force_n, nearest.outward_normal), pressed.depth_mm, dot(force_n, nearest.outward_normal)};
  return force_n;
}

void Simulation::touch(const Vector3& before_mm, std::array<AxisState, 3>& axes,
                       const std::array<const AxisDynamics*, 3>& dynamics) noexcept {
  const Vector3 free_mm{axes[0].tip_mm, axes[1].tip_mm, axes[2].tip_mm};
  ObjectPose& pose = object_->pose;
  Vector3 object_moved_mm;
  double there = 1.0;
  Projection nearest;
  if (pose.displaced()) {
    pose.advance(truth_.reaction_force_n * -1.0);
    const Vector3 seen_mm = pose.to_object(free_mm);
    nearest = project(object_->model.shape, seen_mm);
    nearest.point_mm = pose.to_rig(nearest.point_mm);
    nearest.outward_normal = pose.direction_to_rig(nearest.outward_normal);
    object_moved_mm = pose.moved_mm(free_mm);
    there = pose.share_at(seen_mm);
  } else {
    nearest = project(object_->model.shape, free_mm);
  }
  const Vector3& n = nearest.outward_normal;

  double compliance = 0.0;
  for (std::size_t i = 0; i < 3; ++i) {
    compliance += component(n, i) * component(n, i) * dynamics[i]->tip_position_per_tip_force();
  }
  // Matter that is stiffer by a factor meets a tip that yields more by it, in forces smaller by it.
  double scale = object_->model.stiffness_scale(nearest.point_mm);
  if (pose.displaced()) scale *= there;
  constexpr double kFarAwayMm = -1e3;
  Material::Step step;
  Vector3 across_n;  // a phantom's force is not along the normal
  if (object_->phantom) {
    across_n = press_phantom(free_mm, compliance, nearest, step);
    across_n = across_n - n * step.force_n;
  } else {
    step = std::visit(
        [&](auto& material) {
          return there > 0.0 ? material.advance(nearest.depth_mm, compliance * scale)
                             : material.advance(kFarAwayMm, compliance);
        },
        object_->material);
    step.mean_force_n *= scale;
    step.force_n *= scale;
  }

  Vector3 tangential_n;
  if (step.mean_force_n > 0.0) {
    const Vector3 moved = free_mm - before_mm - object_moved_mm;
    tangential_n = std::visit(
        [&](auto& friction) {
          friction.project(n);
          return friction.advance(moved - n * dot(moved, n), dynamics[0]->tip_position_per_tip_force(),
                                  step.mean_force_n);
        },
        object_->friction);
  } else {
    std::visit([](auto& friction) { friction.release(); }, object_->friction);
  }
  const Vector3 mean_n = n * step.mean_force_n + across_n + tangential_n;
  for (std::size_t i = 0; i < 3; ++i) dynamics[i]->add_tip_force(axes[i], component(mean_n, i));

  truth_.reaction_force_n = n * step.force_n + across_n + tangential_n;
  truth_.undeformed_contact_mm = nearest.point_mm;
  truth_.outward_normal = n;
  truth_.displacement_mm = std::max(0.0, step.depth_mm);
  truth_.normal_force_n = step.force_n;
  truth_.friction_force_n = std::sqrt(dot(across_n + tangential_n, across_n + tangential_n));
  truth_.surface_depression_mm =
      object_->phantom
          ? truth_.displacement_mm
          : std::visit([](const auto& material) { return material.depression_mm(); }, object_->material);
  truth_.in_contact = step.mean_force_n > 0.0;
}

}  // namespace hapticd::sim
