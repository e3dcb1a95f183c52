#pragma once

#include <cstdint>
#include <memory>

#include "hal/error.h"
#include "server/config/config.h"

namespace hapticd::server {

/// How a process ends.
enum class ExitCode : int {
  kClean = 0,
  kBadConfiguration = 2,  ///< command line, configuration file, or the scene to start with
  kCannotListen = 3,      ///< e.g. because another daemon does
  kCannotOpenRig = 4,
};

struct StartFailure {
  ExitCode code = ExitCode::kBadConfiguration;
  hal::Error error;
};

/// The whole service in one object: rig, loop, fan-out and network. Started in that order, stopped force
/// first.
class Daemon {
 public:
  /// Serves when it returns. On failure `failure` says why and nothing is left behind.
  static std::unique_ptr<Daemon> start(const DaemonConfig& config, StartFailure& failure);
  /// Shuts down.
  ~Daemon();
  Daemon(const Daemon&) = delete;
  Daemon& operator=(const Daemon&) = delete;

  /// Opens the rig and resolves the scene as start() would, without serving.
  static std::unique_ptr<StartFailure> check(const DaemonConfig& config);

  std::uint16_t port() const;
  /// Port of connections with certificates; 0 if there are none.
  std::uint16_t tls_port() const;
  /// Port of metrics; 0 if they are off.
  std::uint16_t metrics_port() const;
  /// Takes the force off and ends all but the network: what is recorded is written, streams and waiting calls
  /// are ended, the state is that of a clean end.
  void stop();
  /// Stops, and closes the network.
  void shutdown();

 private:
  struct Parts;
  explicit Daemon(std::unique_ptr<Parts> parts);
  std::unique_ptr<Parts> parts_;
};

}  // namespace hapticd::server
