#pragma once

#include <chrono>
#include <memory>
#include <string>

#include "client/cpp/address.h"
#include "client/cpp/error.h"
#include "client/cpp/identification_stream.h"
#include "client/cpp/recording_upload.h"
#include "client/cpp/telemetry_stream.h"
#include "client/cpp/turntable_stream.h"
#include "hapticd/v1/identification.pb.h"
#include "hapticd/v1/model.pb.h"
#include "hapticd/v1/rendering.pb.h"
#include "hapticd/v1/rig.pb.h"
#include "hapticd/v1/safety.pb.h"
#include "hapticd/v1/scene.pb.h"
#include "hapticd/v1/simulation.pb.h"
#include "hapticd/v1/telemetry.pb.h"
#include "hapticd/v1/turntable.pb.h"

namespace hapticd::client {

struct ClientOptions {
  /// "host:port", "[v6]:port" or "unix:/path".
  std::string address = kDefaultAddress;
  /// For connecting, and for each call; a target set for later is given its lead on top.
  std::chrono::milliseconds timeout{5000};
};

/// Whether the loop's state comes with its histograms: 25 kB that who asks often can do without.
enum class Histograms { kWith, kWithout };

/// A scene: by the name the daemon knows it by, or as the text of a scene file. One of the two.
struct SceneSource {
  std::string name = {};
  std::string toml = {};
  std::string object_model = {};  ///< in the place of the scene's own; empty = the scene's own
};

/// A connection to a daemon: one function for each call of the contract, whose messages are described in
/// proto/hapticd/v1 with units and ranges. Any thread may call; calls of several threads do not wait for one
/// another.
///
/// Every function throws Error: kUnreachable and kTimedOut where no answer came (ClientOptions::timeout),
/// kRefused with the daemon's reason (Error::detail().reason(), see v1.ErrorReason) otherwise. Which reasons
/// to expect is said at each call, besides UNAVAILABLE while the daemon starts or ends.
///
///     hapticd::client::Client client({.address = "127.0.0.1:50051"});
///     client.load_scene({.name = "tap_1d"});
///     hapticd::v1::SetTargetRequest request;
///     request.set_stiffness_n_per_mm(0.3);
///     const auto answer = client.set_target(request);  // answer.granted_n_per_mm()
class Client {
 public:
  /// Connects; throws Error when the address is none or no one answers within the timeout.
  explicit Client(ClientOptions options);
  Client(Client&&) noexcept;
  Client& operator=(Client&&) noexcept;
  ~Client();

  const std::string& address() const noexcept;

  // The rig.
  /// Device, sensor, rate and limits; the same from the daemon's start to its end.
  v1::RigInfo rig_info();
  /// A snapshot of now: guard, scene, contact, forces in N, loop statistics in ns.
  v1::RigState rig_state(Histograms histograms = Histograms::kWith);
  /// Waits ten seconds beyond the timeout: hardware may take its time.
  v1::Diagnosis diagnose(bool probe);
  /// Takes the sensor's present load as zero: tool free, upright, at rest. Takes 0.25 s. Refused: IN_CONTACT,
  /// NO_HARDWARE, BUSY (an identification or a motion of the table), WRONG_STATE where no sample comes.
  v1::SensorBias bias_force_sensor();
  /// Takes the pose in which the device rests as its reset pose; returns at once. Refused: IN_CONTACT,
  /// WRONG_STATE.
  void home_device();

  // Scenes.
  v1::ListScenesResponse scenes();
  /// Waits ten seconds beyond the timeout: the hardware of the scene may have to be opened. Refused:
  /// NOT_FOUND, INVALID, OUT_OF_RANGE, BUSY, WRONG_STATE (a model or a part is missing).
  v1::LoadSceneResponse load_scene(const SceneSource& source);
  /// The force goes to zero as fast as the guard lets it. Refused: BUSY.
  v1::UnloadSceneResponse unload_scene();
  /// What a scene is composed of, needs and costs, without loading it. Refused: NOT_FOUND, INVALID.
  v1::SceneOutline explain_scene(const SceneSource& source);

  // Models of objects.
  v1::ListModelsResponse models();
  /// Refused: NOT_FOUND.
  v1::GetModelResponse model(const std::string& name);
  v1::ListStoredModelsResponse stored_models(const v1::ListStoredModelsRequest& request);
  /// Hashes are whole, or any unambiguous beginning of at least 6 digits.
  v1::StoredModel stored_model(const std::string& hash);
  v1::DiffStoredModelsResponse diff_stored_models(const std::string& hash_a, const std::string& hash_b);
  /// Tags are names that move: a scene finds a model as object@tag. Refused: NOT_FOUND, INVALID, DISK_FULL,
  /// STORE_LOST.
  v1::StoredModel tag_stored_model(const std::string& hash, const std::string& tag);
  v1::StoredModel untag_stored_model(const std::string& hash, const std::string& tag);
  /// Refused: NOT_FOUND, IN_USE by the loaded scene.
  v1::DeleteStoredModelResponse delete_stored_model(const std::string& hash);
  /// The model as JSON, for import_stored_model() of any daemon.
  v1::ExportStoredModelResponse export_stored_model(const std::string& hash);
  v1::StoredModel import_stored_model(const std::string& json);

  // Rendering.
  /// Target stiffness in N/mm, or a law; the answer says what was granted, and from which tick on. Refused:
  /// NO_SCENE, OUT_OF_RANGE, NOT_IN_THIS_SCENE, STATE_CHANGED, TOO_MANY. Returns when the target took effect;
  /// waits out `at_time_ns`, if that is given, beyond the timeout.
  v1::SetTargetResponse set_target(const v1::SetTargetRequest& request);
  /// Which target stiffnesses in N/mm can be rendered at a reaction in N and a displacement in mm (3.8);
  /// without them, of the present contact. Refused: NO_SCENE, NOT_IN_CONTACT, OUT_OF_RANGE.
  v1::FeasibleRange feasible_range(const v1::GetFeasibleRangeRequest& request);

  // Safety.
  /// The force is cut with the next tick, in every state; returns when it was. `reason`: for the log.
  v1::StopResponse stop(const std::string& reason);
  /// Leaves the latch; force rises from zero over half a second. Refused: FAULT_PERSISTS.
  v1::ClearResponse clear();
  /// The table of faults: what follows from each, and the remedy.
  v1::ListFaultsResponse faults();

  // The simulated rig only; else refused: NOT_SIMULATED.
  v1::SimulationInfo simulation();
  /// What the simulated hand does from now on. Refused: OUT_OF_RANGE, INVALID.
  void set_hand_program(const v1::HandProgram& program);
  /// Puts another simulated object in place. Refused: NOT_FOUND.
  v1::SimulationInfo set_object(const std::string& name);

  // Identification.
  /// Starts one and returns its id; watch_identification() follows it. Refused: BUSY, GUARD_LATCHED,
  /// NO_HARDWARE, NOT_FOUND, INVALID.
  v1::StartIdentificationResponse start_identification(const v1::StartIdentificationRequest& request);
  /// Returns when it is over, half a minute beyond the timeout at the latest: the last fit takes its time.
  /// Empty = the one that runs.
  v1::IdentificationProgress cancel_identification(const std::string& identification);
  v1::ListIdentificationsResponse identifications();
  /// Empty = the one that runs, else the last one. Refusals are reported by the stream's first next().
  IdentificationStream watch_identification(const std::string& identification);
  /// Refusals are reported while it is sent.
  RecordingUpload upload_recording(const v1::RecordingDescription& description);

  // The turntable; refused where the rig has none: NO_HARDWARE.
  v1::Turntable turntable();
  /// Refusals are reported by the stream's first next().
  TurntableStream home_turntable();
  TurntableStream move_turntable(const v1::MoveToRequest& request);
  /// As fast as the drive can, whichever client began the motion.
  v1::TurntableStatus stop_turntable();
  /// Clears an alarm of the drive.
  v1::TurntableStatus clear_turntable();
  /// Waits until the drive has reported its position, up to half a minute beyond the timeout.
  v1::TurntableStatus engage_turntable();
  v1::TurntableStatus disengage_turntable();

  // Telemetry.
  /// Refusals are reported by the stream's first next().
  TelemetryStream subscribe(const v1::SubscribeRequest& request);

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace hapticd::client
