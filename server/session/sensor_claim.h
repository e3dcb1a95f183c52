#pragma once

#include <utility>

namespace hapticd::server {

class Session;

/// Keeps the force sensor open for as long as it lives: for a scene that uses it, a motion of the table, or
/// an identification. The sensor closes with the last claim. Must not outlive its session.
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
