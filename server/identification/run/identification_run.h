#pragma once

#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "hal/tip_instrument.h"
#include "server/identification/run/identification_runner.h"
#include "server/identification/run/observation_file.h"
#include "server/identification/run/recorded_observations.h"
#include "server/identification/run/rig_view.h"

namespace hapticd::server {

/// Instrument from outside of the rig, open for as long as it is wanted. Only identifications use it, and one
/// of them at a time.
class OpenInstrument {
 public:
  OpenInstrument() = default;
  OpenInstrument(const OpenInstrument&) = delete;
  OpenInstrument& operator=(const OpenInstrument&) = delete;
  ~OpenInstrument() { close(); }

  /// Opens the rig if there is hardware behind it; a simulated one is always there.
  std::optional<hal::Error> open(hal::Rig& rig) {
    rig_ = dynamic_cast<hal::InstrumentedRig*>(&rig);
    return rig_ == nullptr ? std::nullopt : rig_->engage_instrument();
  }
  void close() noexcept {
    if (auto* const rig = std::exchange(rig_, nullptr)) rig->disengage_instrument();
  }

 private:
  hal::InstrumentedRig* rig_ = nullptr;
};

/// One identification under way; lives in its thread.
struct IdentificationRunner::Run {
  IdentificationRequest request;
  std::string id;
  std::unique_ptr<identification::Identification> identification;
  std::shared_ptr<const StoredRecording> recording;
  std::optional<RecordedObservations> rows;
  std::optional<SceneHost::Reservation> reservation;
  std::optional<SensorClaim> sensor;    ///< held open for as long as it listens
  OpenInstrument instrument;            ///< the same
  std::optional<RigView> view;          ///< of the live rig
  std::optional<ObservationFile> kept;  ///< what the rig measured, if the store has a place for it
  std::string instruction;
  identification::MotionRequest::Device device =
      identification::MotionRequest::Device::kNothing;  ///< what it does now
  std::optional<rt::SceneSpec> rendered;                ///< the scene that does it
  rt::GuardLimits usual;  ///< of the scene before: how late sensor and loop may be on this rig
};

/// Text as stored with an identification that is over.
std::string text_of(IdentificationState state);

}  // namespace hapticd::server
