#pragma once

#include <chrono>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include "hal/error.h"
#include "server/config/config.h"
#include "server/connection/stop_sockets.h"

namespace hapticd::pose {
class PosePublisher;
}

namespace hapticd::server {

class AuditLog;
class ConsoleRegistry;
class EventLog;
class FlightRecorder;
class CalibrationRunner;
class GuideHost;
class LeaseManager;
class NamedIdentities;
class Recorder;
class RolePolicy;
class SafetyLatch;
class IdentificationRunner;
class SceneHost;
class SensorBiases;
class Session;
class TargetControl;
class TelemetryHub;
class TurntableHost;
class Watchdog;

/// The network side of the daemon: all services, health checking and reflection, on loopback TCP, a
/// unix socket, and with certificates on any other address.
class GrpcServer {
 public:
  struct Parts {
    Session& session;
    SceneHost& scenes;
    TargetControl& targets;
    SafetyLatch& latch;
    TelemetryHub& hub;
    SensorBiases& biases;
    IdentificationRunner& identifications;
    CalibrationRunner& calibrations;
    TurntableHost& turntable;
    GuideHost& guide;
    const RolePolicy& policy;
    LeaseManager& leases;
    AuditLog& audit;
    Watchdog& watchdog;
    Recorder& recorder;
    FlightRecorder& flight;
    pose::PosePublisher& poses;
    ConsoleRegistry& consoles;
    NamedIdentities& named;
    EventLog& events;
  };

  /// Checks: an error when another program listens there already, or the certificates cannot be used; to be
  /// asked before anything else is taken hold of.
  static std::optional<hal::Error> check(const DaemonConfig& config);
  /// Starts. An error when an address cannot be bound. Reports itself as not serving until set otherwise.
  static hal::Result<std::unique_ptr<GrpcServer>> start(const Parts& parts, const DaemonConfig& config);
  ~GrpcServer();
  GrpcServer(const GrpcServer&) = delete;
  GrpcServer& operator=(const GrpcServer&) = delete;

  /// The TCP port in use.
  std::uint16_t port() const;
  /// Port of connections with certificates; 0 if there are none.
  std::uint16_t tls_port() const;
  void set_serving(bool serving);
  /// Sockets by which stops come that do not pass gRPC. To be taken once.
  StopSockets take_stop_sockets();
  /// Group that may open the unix socket.
  const std::string& unix_group() const;
  /// Shuts down: no new calls; those under way may end within `timeout`, then they are cancelled.
  void shutdown(std::chrono::milliseconds timeout);

 private:
  struct State;
  explicit GrpcServer(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

}  // namespace hapticd::server
