#include "server/grpc/messages/telemetry_messages.h"

#include "server/grpc/messages/enums.h"

namespace hapticd::server {

void fill_vector(const hal::Vector3& vector, v1::Vector3& message) {
  message.set_x(vector.x);
  message.set_y(vector.y);
  message.set_z(vector.z);
}

namespace {

void fill_sample(const rt::TickRecord& record, v1::SampleGroup& group) {
  fill_vector(record.tip_position_mm, *group.mutable_tip_position_mm());
  fill_vector(record.sensor_force_n, *group.mutable_sensor_force_n());
  group.set_status_bits(record.sample_status);
  group.set_force_count(record.force_count);
  group.set_force_age_ms(static_cast<double>(record.force_age_ns) * 1e-6);
  group.set_bias_serial(record.bias_serial);
  v1::Quaternion& orientation = *group.mutable_orientation();
  orientation.set_w(record.tip_orientation.w);
  orientation.set_x(record.tip_orientation.x);
  orientation.set_y(record.tip_orientation.y);
  orientation.set_z(record.tip_orientation.z);
  fill_vector(record.sensor_torque_n_mm, *group.mutable_sensor_torque_n_mm());
  group.set_angular_velocity_x_rad_per_s(record.angular_velocity_rad_per_s.x);
  group.set_angular_velocity_y_rad_per_s(record.angular_velocity_rad_per_s.y);
  group.set_angular_velocity_z_rad_per_s(record.angular_velocity_rad_per_s.z);
}

void fill_angles(const hal::DeviceAngles& angles, v1::AngleGroup& group) {
  group.set_joint_1_rad(angles.joint_rad[0]);
  group.set_joint_2_rad(angles.joint_rad[1]);
  group.set_joint_3_rad(angles.joint_rad[2]);
  group.set_gimbal_1_rad(angles.gimbal_rad[0]);
  group.set_gimbal_2_rad(angles.gimbal_rad[1]);
  group.set_gimbal_3_rad(angles.gimbal_rad[2]);
}

void fill_motion(const rt::TickRecord& record, v1::MotionGroup& group) {
  group.set_velocity_mm_per_s(record.velocity_mm_per_s);
  group.set_acceleration_mm_per_s2(record.acceleration_mm_per_s2);
}

void fill_contact(const rt::TickRecord& record, v1::ContactGroup& group) {
  group.set_in_contact(record.in_contact);
  group.set_reason(to_proto(record.contact_reason));
  group.set_contact_count(record.contact_count);
  group.set_reaction_force_n(record.reaction_force_n);
  group.set_withdrawn_count(record.withdrawn_count);
  group.set_authority(record.contact_authority);
  group.set_detection_force_n(record.contact_force_n);
}

void fill_zero(const rt::TickRecord& record, v1::ZeroGroup& group) {
  fill_vector(record.zero.force_n, *group.mutable_force_n());
  fill_vector(record.zero.torque_n_mm, *group.mutable_torque_n_mm());
  fill_vector(record.jump_n, *group.mutable_jump_n());
  group.set_jump_count(record.jump_count);
  fill_vector(record.last_jump_n, *group.mutable_last_jump_n());
}

void fill_target(const rt::TickRecord& record, v1::TargetGroup& group) {
  group.set_target_stiffness_n_per_mm(record.target_stiffness_n_per_mm);
  group.set_desired_force_n(record.desired_force_n);
}

void fill_control(const rt::TickRecord& record, v1::ControlGroup& group) {
  group.set_commanded_force_n(record.commanded_force_n);
  group.set_hand_force_n(record.hand_force_n);
  group.set_feasible_min_n_per_mm(record.feasible_min_n_per_mm);
  group.set_feasible_max_n_per_mm(record.feasible_max_n_per_mm);
}

void fill_guard(const rt::TickRecord& record, v1::GuardGroup& group) {
  fill_vector(record.device_command_n, *group.mutable_device_command_n());
  group.set_state(to_proto(record.guard_state));
  group.set_fault(to_proto(record.guard_fault));
  group.set_limited_bits(record.guard_limits);
  group.set_authority(record.authority);
  group.set_faults_present_bits(record.faults_present);
}

void fill_timing(const rt::TickRecord& record, v1::TimingGroup& group) {
  group.set_wakeup_ns(record.timing.wakeup_ns);
  group.set_device_ns(record.timing.device_ns);
  group.set_compute_ns(record.timing.compute_ns);
  group.set_periods_missed(record.timing.periods_missed);
  group.set_overrun(to_proto(record.timing.overrun));
}

void fill_truth(const rt::TickRecord& record, v1::TruthGroup& group) {
  fill_vector(record.truth.tip_position_mm, *group.mutable_tip_position_mm());
  fill_vector(record.truth.hand_force_n, *group.mutable_hand_force_n());
  fill_vector(record.truth.reaction_force_n, *group.mutable_reaction_force_n());
  fill_vector(record.truth.device_force_n, *group.mutable_device_force_n());
  group.set_displacement_mm(record.truth.displacement_mm);
  group.set_normal_force_n(record.truth.normal_force_n);
  group.set_friction_force_n(record.truth.friction_force_n);
  group.set_in_contact(record.truth.in_contact);
  fill_vector(record.truth.outward_normal, *group.mutable_normal());
  fill_vector(record.truth.undeformed_contact_mm, *group.mutable_undeformed_contact_mm());
}

void fill_direction(const rt::TickRecord& record, v1::DirectionGroup& group) {
  fill_vector(record.normal, *group.mutable_normal());
  fill_vector(record.reaction_n, *group.mutable_reaction_n());
  fill_vector(record.friction_force_n, *group.mutable_friction_force_n());
  group.set_sliding_mm_per_s(record.sliding_mm_per_s);
}

void fill_fusion(const rt::TickRecord& record, v1::FusionGroup& group) {
  group.set_law_displacement_mm(record.law_displacement_mm);
  group.set_displacement_deviation_mm(record.displacement_deviation_mm);
}

void fill_passivity(const rt::TickRecord& record, v1::PassivityGroup& group) {
  group.set_hand_energy_mj(record.hand_energy_mj);
  group.set_passivity_damping_n_s_per_mm(record.passivity_damping_n_s_per_mm);
}

void fill_inclusion(const rt::TickRecord& record, v1::InclusionGroup& group) {
  group.set_strongest(record.inclusion);
  fill_vector(record.inclusion_position_mm, *group.mutable_position_mm());
  fill_vector(record.inclusion_force_n, *group.mutable_force_n());
}

void fill_friction_target(const rt::TickRecord& record, v1::FrictionGroup& group) {
  group.set_scale(record.friction_scale);
  group.set_is_bounded(record.friction_is_bounded);
  fill_vector(record.friction_added_n, *group.mutable_added_n());
  group.set_feasible_min(record.friction_feasible_min);
  group.set_feasible_max(record.friction_feasible_max);
}

void fill_transient(const rt::TickRecord& record, v1::TransientGroup& group) {
  group.set_force_n(record.transient_force_n);
  group.set_impact_mm_per_s(record.transient_impact_mm_per_s);
  group.set_amplitude_share(record.transient_share);
  group.set_count(record.transient_count);
}

void fill_assist(const rt::TickRecord& record, v1::AssistGroup& group) {
  fill_vector(record.guide_force_n, *group.mutable_guide_force_n());
  group.set_guide_state(static_cast<std::uint32_t>(record.guide_state));
  group.set_guide_number(record.guide_number);
  fill_vector(record.fixture_force_n, *group.mutable_fixture_force_n());
  group.set_presentation(record.presentation);
  group.set_presentation_flaws(record.presentation_broken);
}

}  // namespace

void fill(const rt::TickRecord& record, std::uint32_t wanted_channels, v1::TelemetrySample& sample) {
  using namespace rt::channel;
  sample.set_tick(record.tick);
  sample.set_time_ns(record.time_ns);
  sample.set_scene_generation(record.scene_generation);
  const std::uint32_t reported = record.channels & wanted_channels;
  if ((reported & kSample) != 0) fill_sample(record, *sample.mutable_sample());
  if ((reported & kMotion) != 0) fill_motion(record, *sample.mutable_motion());
  if ((reported & kContact) != 0) fill_contact(record, *sample.mutable_contact());
  if ((reported & kZero) != 0) fill_zero(record, *sample.mutable_zero());
  if ((reported & kDeformation) != 0)
    sample.mutable_deformation()->set_displacement_mm(record.displacement_mm);
  if ((reported & kTarget) != 0) fill_target(record, *sample.mutable_target());
  if ((reported & kControl) != 0) fill_control(record, *sample.mutable_control());
  if ((reported & kGuard) != 0) fill_guard(record, *sample.mutable_guard());
  if ((reported & kTiming) != 0) fill_timing(record, *sample.mutable_timing());
  if ((reported & kTruth) != 0) fill_truth(record, *sample.mutable_truth());
  if ((reported & kDirection) != 0) fill_direction(record, *sample.mutable_direction());
  if ((reported & kFusion) != 0) fill_fusion(record, *sample.mutable_fusion());
  if ((reported & kPassivity) != 0) fill_passivity(record, *sample.mutable_passivity());
  if ((reported & kInclusion) != 0) fill_inclusion(record, *sample.mutable_inclusion());
  if ((reported & kFriction) != 0) fill_friction_target(record, *sample.mutable_friction());
  if ((reported & kTransient) != 0) fill_transient(record, *sample.mutable_transient());
  if ((reported & kAngles) != 0) fill_angles(record.angles, *sample.mutable_angles());
  if ((reported & kAssist) != 0) fill_assist(record, *sample.mutable_assist());
}

}  // namespace hapticd::server
