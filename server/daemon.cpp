#include "server/daemon.h"

#include <chrono>
#include <cmath>
#include <filesystem>
#include <utility>

#include "server/access/audit_log.h"
#include "server/access/certificate.h"
#include "server/access/console_registry.h"
#include "server/access/lab.h"
#include "server/access/lease_manager.h"
#include "server/access/named_identities.h"
#include "server/access/role_policy.h"
#include "server/access/unknown_names.h"
#include "server/calibration/run/calibration_runner.h"
#include "server/grpc/grpc_server.h"
#include "server/grpc/recording/event_notes.h"
#include "server/grpc/recording/recording_setup.h"
#include "server/guide/guide_host.h"
#include "server/identification/run/identification_runner.h"
#include "server/metrics/metrics_server.h"
#include "server/model/store/model_store.h"
#include "server/pose/pose_publisher.h"
#include "server/pose/scene_facts.h"
#include "server/process/crash_guard.h"
#include "server/process/instance_lock.h"
#include "server/process/log.h"
#include "server/process/run_marker.h"
#include "server/process/service_manager.h"
#include "server/process/system_clock.h"
#include "server/process/version.h"
#include "server/recording/event_log.h"
#include "server/recording/exporter.h"
#include "server/recording/flight/flight_recorder.h"
#include "server/recording/guard_monitor.h"
#include "server/recording/recorder.h"
#include "server/rig/rig_factory.h"
#include "server/rig/sensor_bias.h"
#include "server/rig_file/turntable_factory.h"
#include "server/scene/scene_host.h"
#include "server/scene/target_control.h"
#include "server/session/loop_watchdog.h"
#include "server/session/safety_latch.h"
#include "server/session/session.h"
#include "server/stop/stop_audit.h"
#include "server/stop/stop_server.h"
#include "server/telemetry/telemetry_hub.h"
#include "server/turntable/turntable_host.h"
#include "server/watchdog/watchdog.h"

namespace hapticd::server {

// In the order in which they are started; stopped in reverse order.
struct Daemon::Parts {
  Parts(std::unique_ptr<hal::Rig> rig, std::unique_ptr<hal::Turntable> table,
        std::shared_ptr<ModelStore> models, const DaemonConfig& config)
      : store(std::move(models)),
        session(std::move(rig), config.loop),
        hub(session.engine()),
        scenes(session, SceneLibrary(config.scene_folder), ModelLibrary(config.model_folder, store),
               config.guard),
        biases(session, scenes, hub, store->in_memory() ? "" : store->path() + ".data/sensor_biases.csv"),
        targets(session, scenes, hub, config.guard),
        latch(session, hub),
        identifications(session, scenes, hub, biases, *store),
        calibration_store(store->in_memory() ? "" : store->path() + ".data/calibrations",
                          session.rig_info().name),
        calibrations(session, hub, calibration_store),
        turntable(std::move(table), config.turntable.interlock, session, scenes, hub),
        guide(session, scenes, hub, turntable),
        policy(with_lab(config.access, config.certificates)),
        leases(effects(), std::chrono::nanoseconds(std::llround(config.access.take_notice_s * 1e9))),
        named(policy),
        watchdog(config.watchdog, session),
        recording_sources(sources_of(config, session, scenes)),
        recorder(hub, events, recording_sources, config.recording),
        flight(hub, events, recording_sources, config.recording),
        device_frame(pose::device_frame_of(config)) {
    latch.explain_with([this](rt::GuardFault fault) {
      const bool of_watchdog =
          fault == rt::GuardFault::kEndpointMissing || fault == rt::GuardFault::kPedalReleased;
      return of_watchdog ? missing_words(watchdog.views()) : std::string();
    });
    scenes.know_zero_by([this] { return biases.zero_in_force(); });
    identifications.recordings().keep_free(kRoomFactor * config.recording.keep_free_mb);
    scenes.know_calibration_by([this] { return calibration_store.adopted().get(); });
    turntable.on_motion(notes.of(recording::EventKind::kTurntable));
    identifications.on_end(notes.of(recording::EventKind::kIdentification));
    scenes.check_stations_with([this](const std::string& name) { return turntable.require_station(name); });
  }

  /// Effects of a change of control on the rest.
  LeaseManager::Effects effects() {
    return {[this](std::uint64_t number) {
              session.engine().set_lease(number);
              return session.last_tick();
            },
            [this](LeaseExpiry action) {
              if (action == LeaseExpiry::kRampToZero) session.engine().raise(rt::GuardFault::kClientLost);
              if (action == LeaseExpiry::kStop) latch.stop();
              notes.note(recording::EventKind::kLease, "the lease expired: its holder was not heard of");
            },
            [this](std::uint64_t number, const hal::Error& why) {
              identifications.end_under(number, why);
              calibrations.end_under(number, why);
            }};
  }

  pose::PosePublisher::Parts pose_parts() {
    const auto scene = [this](std::uint32_t) {
      return pose::facts_of(scenes.current().get(), session.rig_info().device);
    };
    const auto reading = [this] { return session.last_reading(); };
    return {hub, session.rig_info(), device_frame, calibration_store.adopted(), scene, reading};
  }

  std::unique_ptr<InstanceLock> lock;
  std::shared_ptr<ModelStore> store;
  Session session;
  TelemetryHub hub;
  EventLog events;
  EventNotes notes{session, events};
  SceneHost scenes;
  SensorBiases biases;
  TargetControl targets;
  SafetyLatch latch;
  IdentificationRunner identifications;
  CalibrationStore calibration_store;
  CalibrationRunner calibrations;
  TurntableHost turntable;
  GuideHost guide;
  RolePolicy policy;
  LeaseManager leases;
  ConsoleRegistry consoles;
  NamedIdentities named;
  Watchdog watchdog;
  GuardMonitor guard_monitor{hub, events};
  const RecordingSources recording_sources;
  Recorder recorder;
  FlightRecorder flight;
  const pose::DeviceFrame device_frame;
  pose::PosePublisher poses{pose_parts()};
  std::unique_ptr<AuditLog> audit;
  std::unique_ptr<RunMarker> marker;
  std::unique_ptr<GrpcServer> network;
  std::unique_ptr<StopServer> stops;
  std::unique_ptr<MetricsServer> metrics;
  std::unique_ptr<LoopWatchdog> loop_watchdog;

  RigFigures figures() {
    const auto running = recorder.running();
    return {.version = version(),
            .rig = session.rig_info().name,
            .running = session.running(),
            .loop = session.statistics(),
            .last = hub.latest(),
            .has_scene = scenes.current() != nullptr,
            .subscribers = hub.subscriber_count(),
            .records_lost = hub.records_dropped(),
            .recording = running.has_value(),
            .recording_lost_ticks = running ? running->lost_ticks : 0,
            .flight_recorder_on = flight.is_on(),
            .incidents = flight.incidents_written(),
            .lease_is_held = leases.snapshot().lease.has_value(),
            .parts = session.part_reports()};
  }
};

Daemon::Daemon(std::unique_ptr<Parts> parts) : parts_(std::move(parts)) {}

namespace {

constexpr std::chrono::milliseconds kShutdownTimeout{1000};
/// Everything that can fail before the service listens: loop, scenes, models, rig, first scene. A dry one
/// creates no file: it checks whether the store could be opened, and uses an empty one.
template <class Parts>
std::unique_ptr<Parts> prepare(const DaemonConfig& config, bool dry, StartFailure& failure) {
  const auto fail = [&failure](ExitCode code, const hal::Error& error) {
    failure = {code, error};
    return nullptr;
  };
  if (const auto loop = rt::validate(config.loop); !loop)
    return fail(ExitCode::kBadConfiguration, loop.error());
  if (const auto error = SceneLibrary(config.scene_folder).check_folder()) {
    return fail(ExitCode::kBadConfiguration, *error);
  }
  if (const auto error = ModelLibrary(config.model_folder).check_folder()) {
    return fail(ExitCode::kBadConfiguration, *error);
  }
  if (const auto error = check_certificate_folder(config.certificates))
    return fail(ExitCode::kBadConfiguration, *error);
  const std::string store_path = config.model_store.value_or("");
  if (const auto error = ModelStore::check(store_path)) return fail(ExitCode::kBadConfiguration, *error);
  if (const auto error = AuditLog::check(config.access.audit_file))
    return fail(ExitCode::kBadConfiguration, *error);
  auto rig = open_rig(config);
  if (!rig) return fail(ExitCode::kCannotOpenRig, rig.error());
  const bool opens = !dry || std::filesystem::exists(store_path);
  auto store = ModelStore::open(opens ? store_path : std::string(), rig_kind_of_models((*rig)->info().kind));
  if (!store) return fail(ExitCode::kBadConfiguration, store.error());
  // Before its limits are read: the device itself may know them better than its data sheet.
  if (!dry) {
    if (const auto error = (*rig)->engage(hal::RigPartKind::kDevice))
      return fail(ExitCode::kCannotOpenRig, *error);
  }
  auto turntable = make_turntable(config.turntable);
  if (!turntable) return fail(ExitCode::kBadConfiguration, turntable.error());
  for (const std::string& line : unknown_names(config.access)) log_warning(line);
  auto parts = std::make_unique<Parts>(std::move(*rig), std::move(*turntable), std::move(*store), config);
  if (!config.scene.empty()) {
    if (const auto error = parts->scenes.preload(config.scene))
      return fail(ExitCode::kBadConfiguration, *error);
  }
  if (!dry) {
    if (const auto error = parts->scenes.open_hardware()) return fail(ExitCode::kCannotOpenRig, *error);
  }
  return parts;
}

}  // namespace

std::unique_ptr<StartFailure> Daemon::check(const DaemonConfig& config) {
  StartFailure failure;
  if (prepare<Parts>(config, true, failure)) return nullptr;
  return std::make_unique<StartFailure>(std::move(failure));
}

std::unique_ptr<Daemon> Daemon::start(const DaemonConfig& config, StartFailure& failure) {
  set_log_level(config.log_level);
  // A second daemon must not open the hardware of the first.
  std::unique_ptr<InstanceLock> lock;
  if (!config.unix_socket.empty()) {
    auto acquired = InstanceLock::acquire(config.unix_socket);
    if (!acquired) {
      failure = {ExitCode::kCannotListen, acquired.error()};
      return nullptr;
    }
    lock = std::move(*acquired);
  }
  if (const auto error = GrpcServer::check(config)) {
    failure = {ExitCode::kCannotListen, *error};
    return nullptr;
  }
  auto parts = prepare<Parts>(config, false, failure);
  if (!parts) return nullptr;
  parts->lock = std::move(lock);
  if (!config.state_folder.empty()) {
    auto marker = RunMarker::leave_in(config.state_folder);
    if (!marker) {
      failure = {ExitCode::kBadConfiguration, marker.error()};
      return nullptr;
    }
    parts->marker = std::move(*marker);
    parts->latch.on_cleared([here = parts.get()] { here->marker->acknowledge(); });
  }
  // What cannot be recorded does not keep the rig from running.
  if (const auto error = parts->recorder.open()) log_error("recordings are off: " + error->text());
  if (const auto error = parts->flight.open()) log_error("the flight recorder is off: " + error->text());
  const auto fail = [&](ExitCode code, const hal::Error& error) -> std::unique_ptr<Daemon> {
    if (parts->marker && !parts->marker->found()) parts->marker->end_cleanly();
    failure = {code, error};
    return nullptr;
  };
  const auto cannot_listen = [&](const hal::Error& error) { return fail(ExitCode::kCannotListen, error); };
  // Comes after all other files: what is theirs it refuses.
  auto audit = AuditLog::open(config.access);
  if (!audit) return fail(ExitCode::kBadConfiguration, audit.error());
  parts->audit = std::move(*audit);
  parts->audit->show_to([here = parts.get()](const AuditLine& line) { here->notes.note_call(line); });
  // The network starts before the loop's thread raises its priority: threads inherit the scheduling of their
  // creator.
  auto network = GrpcServer::start(
      {parts->session, parts->scenes,          parts->targets,      parts->latch,     parts->hub,
       parts->biases,  parts->identifications, parts->calibrations, parts->turntable, parts->guide,
       parts->policy,  parts->leases,          *parts->audit,       parts->watchdog,  parts->recorder,
       parts->flight,  parts->poses,           parts->consoles,     parts->named,     parts->events},
      config);
  if (!network) return cannot_listen(network.error());
  parts->network = std::move(*network);
  auto stops =
      StopServer::start({parts->network->take_stop_sockets(), config.listen_tls ? config.certificates : "",
                         StopRights(parts->policy, parts->network->unix_group()),
                         [here = parts.get()] { return here->latch.stop(); },
                         [here = parts.get()](const StopReport& report, std::uint64_t more) {
                           note_stop(report, more, {here->policy, here->network->unix_group(), *here->audit});
                         }});
  if (!stops) return cannot_listen(stops.error());
  parts->stops = std::move(*stops);
  if (config.metrics.listen) {
    auto metrics =
        MetricsServer::start(*config.metrics.listen, [here = parts.get()] { return here->figures(); });
    if (!metrics) return cannot_listen(metrics.error());
    parts->metrics = std::move(*metrics);
    log_info("metrics are shown on http://" +
             ListenAddress{config.metrics.listen->host, parts->metrics->port()}.text() + "/metrics");
  }
  parts->hub.start();
  parts->guard_monitor.start();
  if (parts->marker && parts->marker->found()) {
    parts->session.engine().raise(rt::GuardFault::kUncleanEnd);  // from the first tick on
    log_warning("the last run did not end cleanly (" + parts->marker->path() +
                " was left): no force until someone clears");
  }
  parts->notes.note(recording::EventKind::kDaemon,
                    "hapticd " + std::string(version()) + " runs " + parts->session.rig_info().name +
                        (config.scene.empty() ? "" : " with the scene " + config.scene));
  parts->session.start();
  write_zero_in_crash_of(&parts->session.rig());
  parts->network->set_serving(true);
  if (const auto timeout = watchdog_timeout()) {
    parts->loop_watchdog =
        std::make_unique<LoopWatchdog>(progress_of(parts->session), notify_alive, *timeout);
  }

  log_info("hapticd " + std::string(version()) + " runs " + parts->session.rig_info().name +
           " and listens on " + ListenAddress{config.listen.host, parts->network->port()}.text() +
           " (stops also on the next port and by SIGUSR1)" +
           (config.unix_socket.empty() ? std::string() : " and unix:" + config.unix_socket) +
           (!config.listen_tls
                ? std::string()
                : " and, with certificates, on " +
                      ListenAddress{config.listen_tls->host, parts->network->tls_port()}.text()));
  if (!parts->store->in_memory()) {
    log_info("models are kept in " + parts->store->path());
  } else if (config.model_store == ":memory:" || !config.model_store) {
    log_info("models are kept in memory: what is identified is lost when hapticd ends");
  } else {
    log_warning("there is no place for models: what is identified is lost when hapticd ends (--model-store)");
  }
  log_info(parts->flight.is_on() ? "the flight recorder keeps the last 30 s in " + config.recording.folder
                                 : std::string("the flight recorder is off"));
  for (const std::string& shortcoming : parts->session.realtime_shortcomings()) log_warning(shortcoming);
  return std::unique_ptr<Daemon>(new Daemon(std::move(parts)));
}

Daemon::~Daemon() {
  shutdown();
}

std::uint16_t Daemon::port() const {
  return parts_->network->port();
}

std::uint16_t Daemon::tls_port() const {
  return parts_->network->tls_port();
}

std::uint16_t Daemon::metrics_port() const {
  return parts_->metrics ? parts_->metrics->port() : 0;
}

void Daemon::stop() {
  if (parts_->session.stopping()) return;
  // Before anything that may take long: force to zero. First by the guard, so that the last records show
  // it, then the loop ends.
  parts_->session.refuse_commands();
  parts_->flight.end();
  parts_->latch.end_rendering();
  parts_->session.stop();
  write_zero_in_crash_of(nullptr);
  parts_->turntable.shutdown();
  parts_->leases.shutdown();
  parts_->events.end();
  parts_->network->set_serving(false);
  parts_->metrics.reset();
  parts_->recorder.shutdown();
  parts_->flight.shutdown();
  parts_->poses.stop();
  parts_->hub.stop();
  if (parts_->marker) parts_->marker->end_cleanly();
}

void Daemon::shutdown() {
  stop();
  if (!parts_->stops) return;
  parts_->network->shutdown(kShutdownTimeout);
  parts_->stops.reset();
  log_info("shut down");
}

}  // namespace hapticd::server
