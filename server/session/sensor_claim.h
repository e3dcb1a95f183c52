#pragma once

#include <utility>

namespace hapticd::server {

class Session;

/// Keeps the force sensor open for as long as it lives: of a scene that listens to it, of a motion of the
/// table, of an identification. The sensor is closed with the last one. No longer than its session.
class SensorClaim {
 public:
  SensorClaim() = default;  ///< of nothing
  explicit SensorClaim(Session& session) : session_(&session) {}
  SensorClaim(SensorClaim&& other) noexcept : session_(std::exchange(other.session_, nullptr)) {}
  SensorClaim& operator=(SensorClaim&& other) noexcept {
    std::swap(session_, other.session_);
    return *this;
  }
  ~SensorClaim();

 private:
  Session* session_ = nullptr;
};

}  // namespace hapticd::server
