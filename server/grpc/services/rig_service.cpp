#include "server/grpc/services/rig_service.h"

#include "rt/guard/fault_table.h"
#include "server/diagnosis/certificate_findings.h"
#include "server/diagnosis/diagnosis.h"
#include "server/diagnosis/recording_findings.h"
#include "server/diagnosis/service_findings.h"
#include "server/grpc/calls/call.h"
#include "server/grpc/calls/counted_call.h"
#include "server/grpc/messages/enums.h"
#include "server/grpc/messages/part_messages.h"
#include "server/grpc/messages/status.h"
#include "server/grpc/messages/telemetry_messages.h"
#include "server/grpc/messages/watchdog_messages.h"
#include "server/process/version.h"
#include "server/recording/flight/flight_recorder.h"
#include "server/recording/recorder.h"
#include "server/rig/sensor_bias.h"
#include "server/scene/scene_host.h"
#include "server/session/session.h"
#include "server/telemetry/telemetry_hub.h"
#include "server/text/utf8_text.h"
#include "server/turntable/turntable_host.h"
#include "server/watchdog/watchdog.h"

namespace hapticd::server {

namespace {

v1::RigKind to_proto(hal::RigKind kind) {
  switch (kind) {
    case hal::RigKind::kSimulated:
      return v1::RIG_KIND_SIMULATED;
    case hal::RigKind::kReplay:
      return v1::RIG_KIND_REPLAY;
    case hal::RigKind::kHardware:
      return v1::RIG_KIND_HARDWARE;
  }
  return v1::RIG_KIND_UNSPECIFIED;
}

void fill_record(const hal::PartReport& report, v1::PartReport& reported) {
  reported.set_part(report.part);
  reported.set_state(static_cast<v1::PartState>(static_cast<int>(report.state) + 1));
  fill_report(report, reported);
}

double microseconds(std::int64_t nanoseconds) {
  return static_cast<double>(nanoseconds) * 1e-3;
}

void summarise(const rt::LatencySnapshot& latency, bool with_histogram, v1::LatencySummary& summary) {
  summary.set_count(latency.count);
  summary.set_mean_us(latency.mean_ns * 1e-3);
  summary.set_median_us(microseconds(latency.quantile_ns(0.5)));
  summary.set_p99_us(microseconds(latency.quantile_ns(0.99)));
  summary.set_p999_us(microseconds(latency.quantile_ns(0.999)));
  summary.set_max_us(microseconds(latency.max_ns));
  if (!with_histogram) return;
  for (std::size_t i = 0; i < latency.counts.size(); ++i) {
    if (latency.counts[i] == 0) continue;
    v1::LatencyBucket& bucket = *summary.add_buckets();
    bucket.set_from_us(i == 0 ? 0.0 : microseconds(rt::LatencySnapshot::upper_edge_ns(i - 1)));
    bucket.set_up_to_us(microseconds(rt::LatencySnapshot::upper_edge_ns(i)));
    bucket.set_count(latency.counts[i]);
  }
}

/// True if the scene uses the force sensor, and so follows its zero.
bool uses_sensor(const ResolvedScene& scene) {
  return (scene.outline.channels & rt::channel::kZero) != 0;
}

void fill_bias(const SensorBias& bias, v1::SensorBias& reported) {
  reported.set_id(bias.id);
  reported.set_taken_at_unix_s(bias.taken_unix_s);
  fill_vector(bias.tip_mm, *reported.mutable_tip_mm());
  v1::Quaternion& orientation = *reported.mutable_tip_orientation();
  orientation.set_w(bias.orientation.w);
  orientation.set_x(bias.orientation.x);
  orientation.set_y(bias.orientation.y);
  orientation.set_z(bias.orientation.z);
}

void fill_profile(const rt::TargetLaw& law, v1::StiffnessProfile& profile) {
  for (std::uint32_t i = 0; i < law.knot_count; ++i) {
    v1::StiffnessProfile::Knot& knot = *profile.add_knots();
    knot.set_at_mm(law.knots[i].at_mm);
    knot.set_stiffness_n_per_mm(law.knots[i].stiffness_n_per_mm);
  }
}

void fill_law(const rt::TargetLaw& law, v1::TargetLaw& reported) {
  switch (law.kind) {
    case rt::TargetLaw::Kind::kLinear:
      reported.set_linear_n_per_mm(law.stiffness_n_per_mm);
      break;
    case rt::TargetLaw::Kind::kHuntCrossley: {
      v1::HuntCrossleyLaw& power = *reported.mutable_hunt_crossley();
      power.set_stiffness_n_per_mm_m(law.hunt_crossley.stiffness_n_per_mm_m);
      power.set_damping_n_s_per_mm_m1(law.hunt_crossley.damping_n_s_per_mm_m1);
      power.set_exponent(law.hunt_crossley.exponent);
      break;
    }
    case rt::TargetLaw::Kind::kDisplacementProfile:
      fill_profile(law, *reported.mutable_displacement_profile());
      break;
    case rt::TargetLaw::Kind::kPositionProfile:
      fill_profile(law, *reported.mutable_position_profile());
      fill_vector(law.axis, *reported.mutable_position_profile()->mutable_axis());
      break;
  }
}

/// True if the scene has a target: one that leaves the object as it is has none.
bool has_target(const ResolvedScene& scene) {
  return scene.spec.kind != rt::SceneKind::kExplore || scene.spec.explore.modulated;
}

/// Fills in contact and the sensor's zero in the last tick.
void fill_contact_state(const rt::TickRecord& record, v1::RigState& state) {
  state.set_force_age_ms(static_cast<double>(record.force_age_ns) * 1e-6);
  state.set_bias_serial(record.bias_serial);
  if ((record.channels & rt::channel::kContact) != 0) {
    state.set_contact_reason(server::to_proto(record.contact_reason));
    state.set_detection_force_n(record.contact_force_n);
    state.set_contact_authority(record.contact_authority);
    state.set_withdrawn_count(record.withdrawn_count);
  }
  if ((record.channels & rt::channel::kZero) != 0) {
    fill_vector(record.zero.force_n - record.jump_n, *state.mutable_followed_zero_n());
    state.set_sensor_jump_count(record.jump_count);
    fill_vector(record.last_jump_n, *state.mutable_last_sensor_jump_n());
  }
}

}  // namespace

grpc::Status RigService::GetRigInfo(grpc::ServerContext*, const v1::GetRigInfoRequest*,
                                    v1::RigInfo* response) {
  const hal::RigInfo& rig = session_.rig_info();
  response->set_kind(to_proto(rig.kind));
  response->set_name(printable(rig.name));
  response->set_loop_rate_hz(rig.rate_hz);
  v1::DeviceInfo& device = *response->mutable_device();
  device.set_model(printable(rig.device.model));
  device.set_max_force_n(rig.device.max_force_n);
  device.set_max_continuous_force_n(rig.device.max_continuous_force_n);
  device.set_position_resolution_mm(rig.device.position_resolution_mm);
  device.set_structural_stiffness_n_per_mm(rig.device.structural_stiffness_n_per_mm);
  device.set_apparent_mass_g(rig.device.apparent_mass_g);
  device.set_structural_mode_hz(rig.device.structural_mode_hz);
  device.set_coulomb_friction_n(rig.device.coulomb_friction_n);
  v1::SensorInfo& sensor = *response->mutable_sensor();
  sensor.set_model(printable(rig.sensor.model));
  sensor.set_range_n(rig.sensor.range_n);
  sensor.set_resolution_n(rig.sensor.resolution_n);
  sensor.set_sample_rate_hz(rig.sensor.sample_rate_hz);
  sensor.set_tool_mass_g(rig.sensor.tool_mass_g);
  response->set_renders_force(rig.renders_force);
  response->set_has_truth(rig.has_truth);
  for (const hal::UncertainParameter& parameter : rig.uncertain) {
    v1::UncertainParameter& reported = *response->add_uncertain_parameters();
    reported.set_name(parameter.name);
    reported.set_value(parameter.value);
    reported.set_unit(parameter.unit);
    reported.set_source(parameter.source);
  }
  response->set_server_version(version());
  for (const std::string& shortcoming : session_.realtime_shortcomings()) {
    response->add_realtime_shortcomings(shortcoming);
  }
  return grpc::Status::OK;
}

grpc::Status RigService::GetRigState(grpc::ServerContext*, const v1::GetRigStateRequest* request,
                                     v1::RigState* response) {
  const rt::LoopStatistics statistics = session_.statistics();
  v1::LoopState& loop = *response->mutable_loop();
  loop.set_ticks(statistics.ticks);
  const bool histograms = !request->without_histograms();
  summarise(statistics.jitter, histograms, *loop.mutable_jitter());
  summarise(statistics.timer, histograms, *loop.mutable_timer());
  summarise(statistics.wakeup, histograms, *loop.mutable_wakeup());
  summarise(statistics.compute, histograms, *loop.mutable_compute());
  summarise(statistics.device, histograms, *loop.mutable_device());
  loop.set_periods_missed(statistics.periods_missed);
  loop.set_overruns_by_wakeup(statistics.overruns_by_wakeup);
  loop.set_overruns_by_compute(statistics.overruns_by_compute);
  loop.set_overruns_by_device(statistics.overruns_by_device);
  const bool running = session_.running();  // read once: it may end meanwhile
  loop.set_running(running);
  loop.set_clock_losses(statistics.clock_losses);

  const rt::TickRecord record = hub_.latest();
  response->set_guard_state(to_proto(record.guard_state));
  response->set_guard_fault(to_proto(record.guard_fault));
  const SceneHost::InForce in_force = scenes_.in_force();
  const auto& scene = in_force.scene;
  if (scene) response->set_scene(scene->spec.name);
  if (scene && has_target(*scene)) fill_law(in_force.target, *response->mutable_target_law());
  response->set_target_stiffness_n_per_mm(record.target_stiffness_n_per_mm);
  response->set_in_contact(record.in_contact);
  fill_contact_state(record, *response);
  if (const auto bias = biases_.current()) fill_bias(*bias, *response->mutable_sensor_bias());
  response->set_sensor_bias_lost(biases_.lost().value_or(""));
  if (scene && uses_sensor(*scene)) response->set_zero_bound_n(scene->spec.contact.zero_bound_n);
  response->set_reaction_force_n(record.reaction_force_n);
  response->set_displacement_mm(record.displacement_mm);
  response->set_hand_force_n(record.hand_force_n);
  response->set_telemetry_subscribers(hub_.subscriber_count());
  response->set_telemetry_records_dropped(hub_.records_dropped());
  response->set_tick(record.tick);
  response->set_time_ns(record.time_ns);
  response->set_rig_exhausted(!running && session_.exhausted());
  for (const rt::FaultRule& rule : rt::kFaultTable) {
    if ((record.faults_present & rt::set_of(rule.fault)) != 0)
      response->add_faults_present(to_proto(rule.fault));
  }
  for (const hal::PartReport& report : session_.part_reports()) fill_record(report, *response->add_parts());
  if (turntable_.table() != nullptr) fill_record(turntable_.table()->report(), *response->add_parts());
  for (const EndpointView& view : watchdog_.views()) fill(view, *response->add_watchdog_endpoints());
  if (const auto running = recorder_.running()) {
    response->set_recording(running->id);
    response->set_recording_rows(running->rows);
    response->set_recording_lost_ticks(running->lost_ticks);
  }
  response->set_flight_recorder_on(flight_.is_on());
  if (const auto incident = flight_.last()) {
    response->set_last_incident(repaired_utf8(incident->id));
    response->set_last_incident_cause(repaired_utf8(incident->words));
  }
  return grpc::Status::OK;
}

grpc::Status RigService::Diagnose(grpc::ServerContext*, const v1::DiagnoseRequest* request,
                                  v1::Diagnosis* response) {
  const CountedCall counted(diagnoses_, kMaxSlowCalls);
  if (!counted.admitted()) return counted.refusal("diagnoses", "RigService.Diagnose");
  Findings findings = diagnose({session_, scenes_, hub_, turntable_}, request->probe());
  const Findings of_service = examine_service(session_.loop_config(), state_folder_);
  findings.insert(findings.begin(), of_service.begin(), of_service.end());
  const Findings of_certificates = examine_certificates(certificates_, std::chrono::system_clock::now());
  findings.insert(findings.end(), of_certificates.begin(), of_certificates.end());
  const Findings of_recording = examine_recording(recorder_, flight_);
  findings.insert(findings.end(), of_recording.begin(), of_recording.end());
  for (const Finding& finding : findings) {
    v1::Finding& reported = *response->add_findings();
    reported.set_severity(static_cast<v1::FindingSeverity>(static_cast<int>(finding.severity) + 1));
    reported.set_topic(finding.topic);
    reported.set_text(finding.text);
    reported.set_remedy(finding.remedy);
  }
  return grpc::Status::OK;
}

grpc::Status RigService::BiasForceSensor(grpc::ServerContext* context,
                                         const v1::BiasForceSensorRequest* request,
                                         v1::BiasForceSensorResponse* response) {
  const CountedCall counted(bias_calls_, kMaxSlowCalls);
  if (!counted.admitted()) return counted.refusal("biases of the sensor", "RigService.BiasForceSensor");
  const auto taken = biases_.take(caller_of(*context), request->tool_is_free());
  if (!taken) return to_status(taken.refusal());
  fill_bias(*taken, *response->mutable_bias());
  log_call("force sensor biased", *context);
  return grpc::Status::OK;
}

grpc::Status RigService::HomeDevice(grpc::ServerContext* context, const v1::HomeDeviceRequest*,
                                    v1::HomeDeviceResponse*) {
  const auto refusal = session_.home_device();
  if (refusal) return to_status(*refusal);
  log_call("device homed", *context);
  return grpc::Status::OK;
}

}  // namespace hapticd::server
