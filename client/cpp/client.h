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
/// proto/hapticd/v1. Every function throws Error when there is no answer. Any thread may call.
///
///     hapticd::client::Client client({.address = "127.0.0.1:50051"});
///     client.load_scene({.name = "tap_1d"});
///     hapticd::v1::SetTargetRequest request;
///     request.set_stiffness_n_per_mm(0.3);
///     const auto answer = client.set_target(request);  // answer.granted_n_per_mm()
class Client {
 public:
  /// Connects; throws Error when the address is none or nobody answers within the timeout.
  explicit Client(ClientOptions options);
  Client(Client&&) noexcept;
  Client& operator=(Client&&) noexcept;
  ~Client();

  const std::string& address() const noexcept;

  v1::RigInfo rig_info();
  v1::RigState rig_state(Histograms histograms = Histograms::kWith);
  /// Waits ten seconds beyond the timeout: hardware may take its time.
  v1::Diagnosis diagnose(bool probe);
  v1::SensorBias bias_force_sensor();
  void home_device();

  v1::ListScenesResponse scenes();
  /// Waits ten seconds beyond the timeout: the hardware of the scene may have to be opened.
  v1::LoadSceneResponse load_scene(const SceneSource& source);
  v1::UnloadSceneResponse unload_scene();
  v1::SceneOutline explain_scene(const SceneSource& source);

  v1::ListModelsResponse models();
  v1::GetModelResponse model(const std::string& name);
  v1::ListStoredModelsResponse stored_models(const v1::ListStoredModelsRequest& request);
  /// Hashes are whole, or any unambiguous beginning of at least 6 digits.
  v1::StoredModel stored_model(const std::string& hash);
  v1::DiffStoredModelsResponse diff_stored_models(const std::string& hash_a, const std::string& hash_b);
  v1::StoredModel tag_stored_model(const std::string& hash, const std::string& tag);
  v1::StoredModel untag_stored_model(const std::string& hash, const std::string& tag);
  v1::DeleteStoredModelResponse delete_stored_model(const std::string& hash);
  v1::ExportStoredModelResponse export_stored_model(const std::string& hash);
  v1::StoredModel import_stored_model(const std::string& json);

  /// Returns when the target took effect; waits out `at_time_ns`, if that is given, beyond the timeout.
  v1::SetTargetResponse set_target(const v1::SetTargetRequest& request);
  v1::FeasibleRange feasible_range(const v1::GetFeasibleRangeRequest& request);

  v1::StopResponse stop(const std::string& reason);
  v1::ClearResponse clear();
  v1::ListFaultsResponse faults();

  v1::SimulationInfo simulation();
  void set_hand_program(const v1::HandProgram& program);
  v1::SimulationInfo set_object(const std::string& name);

  v1::StartIdentificationResponse start_identification(const v1::StartIdentificationRequest& request);
  /// Returns when it is over, half a minute beyond the timeout at the latest: the last fit takes its time.
  /// Empty = the one that runs.
  v1::IdentificationProgress cancel_identification(const std::string& identification);
  v1::ListIdentificationsResponse identifications();
  /// Empty = the one that runs, else the last one. Refusals are told by the stream's first next().
  IdentificationStream watch_identification(const std::string& identification);
  /// Refusals are told while it is sent.
  RecordingUpload upload_recording(const v1::RecordingDescription& description);

  v1::Turntable turntable();
  /// Refusals are told by the stream's first next().
  TurntableStream home_turntable();
  TurntableStream move_turntable(const v1::MoveToRequest& request);
  v1::TurntableStatus stop_turntable();
  v1::TurntableStatus clear_turntable();
  /// Waits until the drive has told its position, up to half a minute beyond the timeout.
  v1::TurntableStatus engage_turntable();
  v1::TurntableStatus disengage_turntable();

  /// Refusals are told by the stream's first next().
  TelemetryStream subscribe(const v1::SubscribeRequest& request);

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace hapticd::client
