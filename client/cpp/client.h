#pragma once

#include <chrono>
#include <memory>
#include <string>

#include "client/cpp/address.h"
#include "client/cpp/error.h"
#include "client/cpp/message_stream.h"
#include "client/cpp/recording_upload.h"
#include "client/cpp/stop_outcome.h"
#include "hapticd/v1/access.pb.h"
#include "hapticd/v1/calibration.pb.h"
#include "hapticd/v1/clock.pb.h"
#include "hapticd/v1/event.pb.h"
#include "hapticd/v1/experiment.pb.h"
#include "hapticd/v1/guide.pb.h"
#include "hapticd/v1/identification.pb.h"
#include "hapticd/v1/model.pb.h"
#include "hapticd/v1/pose.pb.h"
#include "hapticd/v1/presentation.pb.h"
#include "hapticd/v1/recording.pb.h"
#include "hapticd/v1/rendering.pb.h"
#include "hapticd/v1/rig.pb.h"
#include "hapticd/v1/safety.pb.h"
#include "hapticd/v1/scene.pb.h"
#include "hapticd/v1/simulation.pb.h"
#include "hapticd/v1/telemetry.pb.h"
#include "hapticd/v1/turntable.pb.h"
#include "hapticd/v1/watchdog.pb.h"

namespace hapticd::client {

/// Address of the daemon, and how long to wait for it.
struct ClientOptions {
  /// "host:port", "[v6]:port" or "unix:/path". Beyond this machine the connection carries certificates;
  /// "tls:host:port" has it carry them within this machine too.
  std::string address = kDefaultAddress;
  /// Timeout for connecting, and for each call. Calls that may take longer say by how much.
  std::chrono::milliseconds timeout{5000};
  /// Folder of client.crt, client.key and authority.crt; empty: see find_certificates().
  std::string certificates = {};
  /// Token of a lease that another program keeps: every call goes under it.
  std::string lease_token = {};
  /// True: a command that needs a lease, while no client holds one, acquires it, and gives it back at the
  /// end.
  bool acquires_lease = false;
  /// Purpose of a lease that is acquired so; shown to others.
  std::string lease_purpose = {};
};

/// Whether rig_state() comes with the loop's histograms. They are 25 kB; leave them out if you ask often.
enum class Histograms { kWith, kWithout };

/// A scene: by the name the daemon knows it by, or as the text of a scene file. One of the two.
struct SceneSource {
  std::string name = {};
  std::string toml = {};
  std::string object_model = {};  ///< in the place of the scene's own; empty = the scene's own
};

/// A connection to a daemon: one function for each call of the contract. docs/contract.md describes the
/// messages with units and ranges of every field.
///
/// Threads: any thread may call; calls of several threads do not wait for one another. Nothing here belongs
/// into a real-time thread.
///
/// Errors: every function that calls the daemon throws Error.
///  - kUnreachable: no daemon answers, or the connection broke. kTimedOut: no answer within
///  ClientOptions::timeout.
///  - kRefused: the daemon says no. "Refused:" below lists the reasons, without their prefix ERROR_REASON_
///    (Error::detail().reason()). Any call can also be refused with UNAVAILABLE while the daemon starts or
///    ends, TOO_MANY if too many calls are under way, and INVALID where a text is not UTF-8.
///
///     hapticd::client::Client client({.address = "127.0.0.1:50051"});
///     client.load_scene({.name = "tap_1d"});
///     hapticd::v1::SetTargetRequest request;
///     request.set_stiffness_n_per_mm(0.3);
///     const auto answer = client.set_target(request);  // answer.granted_n_per_mm()
class Client {
 public:
  /// Connects. Throws Error: kBadAddress if it is not an address, kUnreachable if no daemon answers within
  /// the timeout.
  explicit Client(ClientOptions options);
  Client(Client&&) noexcept;
  Client& operator=(Client&&) noexcept;
  ~Client();

  /// Address as given in the options.
  const std::string& address() const noexcept;

  // Access. A call that needs another role is refused with NOT_PERMITTED. Every command, in what follows, can
  // be refused with LEASE_HELD (another client controls the rig), LEASE_REQUIRED, or LEASE_LOST (it was
  // taken, or expired, before the command took effect).

  /// Identity that this client has for the daemon, its role, and what every call needs.
  v1::Access access();
  /// An address that a browser opens to be this client: secret, and works once, within a minute. A refused()
  /// Error if the daemon shows no console.
  v1::OpenConsoleResponse open_console();
  /// State of the lease: who controls the rig.
  v1::LeaseState lease();
  /// Exclusive control: all calls from now on go under it, and it is renewed in the background until
  /// return_lease() or the end of this object. Time to live 1 … 60 s. Refused: LEASE_HELD, OUT_OF_RANGE.
  v1::LeaseGrant acquire_lease(const v1::AcquireLeaseRequest& request);
  /// Takes the lease from a client that holds it. That one is informed first: waits up to 10 s beyond the
  /// timeout.
  v1::LeaseGrant take_lease(const v1::TakeLeaseRequest& request);
  /// No effect if this client keeps none.
  void return_lease();
  /// Whether the lease that this object acquired is still its own, as far as it can know without a call:
  /// false once the daemon said that it is over, or could not be reached for its time to live.
  bool holds_lease() const;
  /// The state of the lease now, then each change.
  LeaseStream watch_lease();

  // Clocks.

  /// Four stamps, of which the answer has three. ClockSync makes bounds of the offset of them, and is easier
  /// to use.
  v1::ExchangeResponse exchange_clocks(const v1::ExchangeRequest& request);
  /// The daemon's clock against UTC, and who keeps UTC on its machine.
  v1::ClockState clock();

  // The watchdog.

  /// Endpoints of the watchdog, and the daemon's view of each; none if it is not configured.
  v1::Watchdog watchdog();
  /// One message of an endpoint. WatchdogEndpoint follows the nonces and is easier to use. Refused:
  /// NOT_FOUND, BUSY, INVALID, STATE_CHANGED (not the awaited nonce).
  v1::CheckInResponse check_in(const v1::CheckInRequest& request);

  // The rig.

  /// Device, sensor, loop rate (Hz) and limits; the same from the daemon's start to its end.
  v1::RigInfo rig_info();
  /// A snapshot of now: guard, scene, contact, forces in N, loop statistics in µs.
  v1::RigState rig_state(Histograms histograms = Histograms::kWith);
  /// What is wrong with kernel, rights, loop, devices and force, each with its remedy. Takes a second.
  /// `probe`: also opens hardware that no scene uses, to see whether it answers. Waits up to 10 s beyond the
  /// timeout.
  v1::Diagnosis diagnose(bool probe);
  /// Takes the sensor's present load as zero: tool free, upright and at rest. Takes 0.25 s, waits up to 10 s
  /// beyond the timeout. `tool_is_free`: someone has looked, although the sensor reads more than 0.4 N under
  /// its last bias. Refused: IN_CONTACT, BUSY (an identification or a motion of the table), WRONG_STATE (the
  /// sensor reads more than that, no sensor that needs it, or nothing comes from it), TIMED_OUT (biased, but
  /// no sample since).
  v1::SensorBias bias_force_sensor(bool tool_is_free = false);
  /// Takes the pose in which the device rests as its reset pose. Returns at once; done when the part's state
  /// in rig_state() is READY. Refused: IN_CONTACT, WRONG_STATE (nothing to home).
  void home_device();

  // Scenes. BUSY: an identification or a motion of the table is under way.

  /// All that load_scene() finds by name, and which one is loaded.
  v1::ListScenesResponse scenes();
  /// Replaces the loaded scene at a tick boundary. Waits up to 10 s beyond the timeout: hardware of the scene
  /// may have to be opened. Refused: NOT_FOUND (no such scene), INVALID (the text, by line), OUT_OF_RANGE (a
  /// ceiling of the daemon), WRONG_STATE (a model, a part or a station is missing), BUSY, STATE_CHANGED (a
  /// model was deleted meanwhile), TIMED_OUT (another scene is being loaded, or the tip stays in contact),
  /// RECORDING_ENDED.
  v1::LoadSceneResponse load_scene(const SceneSource& source);
  /// Unloads the scene: zero force, nothing runs. Succeeds also if nothing is loaded. Refused: BUSY.
  v1::UnloadSceneResponse unload_scene();
  /// What a scene is made of, needs and costs (ns for each tick), without loading it. Answers also if
  /// something is missing, and names it. Refused: NOT_FOUND, INVALID, OUT_OF_RANGE.
  v1::SceneOutline explain_scene(const SceneSource& source);

  // Models of objects and of the rig. A hash is whole, or an unambiguous beginning of at least 6 hexadecimal
  // digits: else refused with INVALID, or with NOT_FOUND if no model has it. All of the store: BUSY (locked
  // by another process; try again), INTERNAL (damaged).

  /// What scenes get by name: displacements to mm, forces to N, errors as fractions.
  v1::ListModelsResponse models();
  /// One of them as a model file (TOML): `NAME` or `NAME@TAG`. Refused: NOT_FOUND, INVALID (its file cannot
  /// be used).
  v1::GetModelResponse model(const std::string& name);
  /// Identified models, newest first; an empty field of the request sets no condition.
  v1::ListStoredModelsResponse stored_models(const v1::ListStoredModelsRequest& request);
  /// Parameters with units and standard errors.
  v1::StoredModel stored_model(const std::string& hash);
  /// Parameter by parameter, with the distance in standard errors. Refused: INVALID (models of different
  /// kinds).
  v1::DiffStoredModelsResponse diff_stored_models(const std::string& hash_a, const std::string& hash_b);
  /// Gives a tag, 1 … 64 of a-z A-Z 0-9 _ -. One model per kind and object has it: the one before loses it.
  /// Scenes use "current" from their next load on. Refused: INVALID, DISK_FULL, STORE_LOST.
  v1::StoredModel tag_stored_model(const std::string& hash, const std::string& tag);
  /// Refused: NOT_FOUND (it has no such tag), DISK_FULL, STORE_LOST.
  v1::StoredModel untag_stored_model(const std::string& hash, const std::string& tag);
  /// Refused: IN_USE (by the loaded scene), STORE_LOST.
  v1::DeleteStoredModelResponse delete_stored_model(const std::string& hash);
  /// The model as JSON, for import_stored_model() of any daemon.
  v1::ExportStoredModelResponse export_stored_model(const std::string& hash);
  /// Stores it under the same hash; changes nothing if it is there already. Refused: INVALID, DISK_FULL,
  /// STORE_LOST.
  v1::StoredModel import_stored_model(const std::string& json);

  // Rendering.

  /// Target stiffness, 0 … 1000 N/mm, or a law; ramp 0 … 60 s. The answer says what was granted, why not all,
  /// and the tick from which it is in force. Returns then: with `at_time_ns` (rig's clock, up to 60 s ahead)
  /// it waits so much longer than the timeout. Refused: NO_SCENE, INVALID (no target, two, or not finite),
  /// OUT_OF_RANGE, NOT_IN_THIS_SCENE (the law), BUSY, STATE_CHANGED (another scene was loaded while it
  /// waited), TIMED_OUT (withdrawn), RECORDING_ENDED.
  v1::SetTargetResponse set_target(const v1::SetTargetRequest& request);
  /// Stiffnesses, N/mm, that the device can render at a hand force (N) on an object of a stiffness (N/mm),
  /// (3.8). What the request leaves out is taken from the present contact. Refused: NO_SCENE, NOT_IN_CONTACT,
  /// OUT_OF_RANGE.
  v1::FeasibleRange feasible_range(const v1::GetFeasibleRangeRequest& request);

  // Safety.

  /// Stops: zero force from the second tick at the latest, until clear(); any client may, in every state.
  /// Goes by two paths at once, of which one does not pass gRPC; the outcome says which came first. Returns
  /// without waiting for the force. `reason`: for the log, the first 256 bytes. If no connection exists yet,
  /// the function stop() of client/cpp/stop/stop.h does the same and is faster. Throws Error if neither
  /// answers.
  StopOutcome stop(const std::string& reason);
  /// Leaves the latch; the force comes back from zero over the scene's guard.resume_ramp_s. Succeeds also
  /// if nothing was latched. Refused: FAULT_PERSISTS (the detail names fault and remedy).
  v1::ClearResponse clear();
  /// The table of faults: what each does to the force, who ends it, the remedy.
  v1::ListFaultsResponse faults();

  // The simulated hand and object. Refused on other rigs: NOT_SIMULATED.

  /// Object in place, its stiffness in N/mm, and all objects there are.
  v1::SimulationInfo simulation();
  /// What the hand does from now on: forces 0 … 30 N, depths 0 … 50 mm, speeds up to 1500 mm/s. Refused:
  /// INVALID (kind or range), BUSY (the hand identifies).
  void set_hand_program(const v1::HandProgram& program);
  /// Returns when the hand has ended the program that was set last and the tool is free; false when it has
  /// not within `timeout`. Never true of a program that goes on until the next one.
  bool wait_for_hand(std::chrono::milliseconds timeout);
  /// Puts a new object under the tool; a hand that presses lifts off first. Refused: NOT_FOUND, BUSY.
  v1::SimulationInfo set_object(const std::string& name);

  // Identification. It belongs to the daemon, not to the client that started it.

  /// Starts one and returns its id at once. Time limit 1 … 3600 s. Refused: BUSY, GUARD_LATCHED, NO_HARDWARE
  /// (the rig lacks a part), NOT_FOUND (the recording), INVALID, OUT_OF_RANGE.
  v1::StartIdentificationResponse start_identification(const v1::StartIdentificationRequest& request);
  /// Ends one; empty = the one that runs. Returns its last progress when it is over, up to 30 s beyond the
  /// timeout: the last fit takes its time. Succeeds also if it was over. Refused: NOT_FOUND, TIMED_OUT (it
  /// ends, but has not yet).
  v1::IdentificationProgress cancel_identification(const std::string& identification);
  /// The last 64, newest first.
  v1::ListIdentificationsResponse identifications();
  /// Empty = the one that runs, else the last one. Refusals come with the stream's first next(): NOT_FOUND,
  /// TOO_MANY (16 watch already, or 8 of this client).
  IdentificationStream watch_identification(const std::string& identification);
  /// Refusals come while it is sent, see there.
  RecordingUpload upload_recording(const v1::RecordingDescription& description);

  // Calibration by a visual system. It belongs to the daemon, not to the client that started it.

  /// Starts one. Refused: BUSY, NOT_SIMULATED, NOT_FOUND (the tip calibration), INVALID, OUT_OF_RANGE.
  v1::StartCalibrationResponse start_calibration(const v1::StartCalibrationRequest& request);
  /// What the tracker saw, in one stream; some hundred poses a piece serve well. Refused: WRONG_STATE (none
  /// runs), INVALID (a pose that is none), TOO_MANY.
  v1::PushReferencePosesResponse push_reference_poses(
      const std::vector<v1::PushReferencePosesRequest>& pieces);
  /// Fits what was heard, and returns when that is over; `problem` says why nothing was stored.
  v1::CalibrationProgress finish_calibration();
  v1::CalibrationProgress cancel_calibration();
  /// Empty = the one that runs, else the last one.
  CalibrationStream watch_calibration(const std::string& calibration);
  /// Stored ones, newest first, without the field of the target error.
  v1::ListCalibrationsResponse calibrations();
  /// Calibration by hash or its first digits.
  v1::Calibration calibration(const std::string& hash);
  /// Poses are corrected by it from now on; empty = by none. Returns the whole hash. Refused: NOT_FOUND,
  /// WRONG_STATE (a tip calibration, or of another rig).
  std::string adopt_calibration(const std::string& hash);
  /// Refused: NOT_FOUND, IN_USE.
  void delete_calibration(const std::string& hash);

  // The turntable. Refused if the rig has none: NO_HARDWARE.

  /// Angles in degrees, speeds in deg/s; stations, state, and why it must not turn now. Opens nothing.
  v1::Turntable turntable();
  /// Finds the table's zero. Refusals come with the stream's first next(): BUSY, WRONG_STATE (contact, force,
  /// a latched guard), NO_HARDWARE; STATE_CHANGED if it ended before it had arrived (stopped, stalled, alarm,
  /// lost).
  TurntableStream home_turntable();
  /// Turns the table to an angle (deg) or a station. Refused as home_turntable(), and: WRONG_STATE (not
  /// homed), NOT_FOUND (no such station), OUT_OF_RANGE.
  TurntableStream move_turntable(const v1::MoveToRequest& request);
  /// Stops the table as fast as the drive can; any client may. Returns without waiting.
  v1::TurntableStatus stop_turntable();
  /// Leaves a stall or an alarm of the drive; waits up to 30 s beyond the timeout. Refused: WRONG_STATE (the
  /// cause is still there).
  v1::TurntableStatus clear_turntable();
  /// Opens the port and waits until the drive has reported its position, up to 30 s beyond the timeout.
  /// Refused: UNAVAILABLE (the detail says why it does not).
  v1::TurntableStatus engage_turntable();
  /// Stops the table if it moves, and closes the port.
  v1::TurntableStatus disengage_turntable();

  // Experiments.

  /// The device leads the tool, see MoveToolRequest. Refusals come with the stream's first next(): BUSY,
  /// GUARD_LATCHED, NO_SCENE, IN_CONTACT, OUT_OF_RANGE; STATE_CHANGED if it was held back, timed out, was
  /// cancelled, or the guard took the force away.
  GuideStream move_tool(const v1::MoveToolRequest& request);
  /// Refused: NOT_IN_THIS_SCENE (the scene has no [watch]).
  v1::BeginPresentationResponse begin_presentation();
  /// Refused: NOT_IN_THIS_SCENE (none is under way).
  v1::PresentationSummary end_presentation();

  /// How the session goes on, for those who watch; from the program that holds the lease. Refused:
  /// LEASE_REQUIRED.
  void report_experiment(const v1::ExperimentProgress& progress);
  /// The last that was reported.
  v1::ExperimentState experiment();

  // Telemetry.

  /// The loop's records, live: groups, every n-th tick (1 … 10000), samples in a batch (1 … 1000), samples
  /// kept for this client (100 … 60000); 0 = the default. Refusals come with the stream's first next():
  /// OUT_OF_RANGE, INVALID (unknown group), TOO_MANY; UNAVAILABLE when the daemon ends.
  TelemetryStream subscribe(const v1::SubscribeRequest& request);

  // Poses, for those who draw the tool.

  /// The newest pose, 1 … 1000 times a second, predicted up to 100 ms ahead, in the frame of the rig, the
  /// device or the calibration's reference. docs/poses.md explains clocks and signs. Refusals come with the
  /// stream's first next(): OUT_OF_RANGE, INVALID (unknown frame), WRONG_STATE (no calibration for the
  /// reference frame), TOO_MANY; UNAVAILABLE when the daemon ends.
  PoseStream subscribe_poses(const v1::SubscribePosesRequest& request);

  // Recordings of the daemon, and incidents: what its flight recorder kept. They stay with the daemon.
  // Refused with WRONG_STATE if it has no folder for them.

  /// Begins one: its groups, every n-th tick (1 … 10000; 0 = 1), a name and a note. It goes on when this
  /// client ends. Refused: BUSY (another one runs), DISK_FULL (quota or disk), OUT_OF_RANGE, INVALID.
  v1::RecordingFile start_recording(const v1::StartRecordingRequest& request);
  /// Ends it, and returns when its file is finished, up to 10 s beyond the timeout. Refused: WRONG_STATE
  /// (none runs).
  v1::RecordingFile stop_recording();
  /// A note in the one that runs, now; 1 … 4096 bytes. Refused: WRONG_STATE (none runs), INVALID.
  void annotate_recording(const std::string& text);
  /// What happened on the rig, as far as the daemon keeps it, oldest first. Refused: OUT_OF_RANGE.
  v1::ListEventsResponse events(const v1::ListEventsRequest& request);
  /// Sends the events that are kept, then each as it happens. Refused with the stream's first next():
  /// TOO_MANY (16 watch, or 8 of this client).
  EventStream watch_events(const v1::WatchEventsRequest& request);
  /// Oldest first, the one that runs last.
  v1::ListRecordingsResponse recordings(v1::RecordingKind kind);
  /// The file (MCAP). Refusals come with the stream's first next(): NOT_FOUND, BUSY (it still runs),
  /// TOO_MANY.
  RecordingStream get_recording(const v1::GetRecordingRequest& request);
  /// Exports a recording as HDF5 or CSV: columns, span in s, every n-th row. The first piece comes when the
  /// daemon has made the whole file. Refused as get_recording(), and: INVALID (a column that it does not
  /// have, no row in the span).
  RecordingStream export_recording(const v1::ExportRecordingRequest& request);
  /// Refused: NOT_FOUND, BUSY (it still runs).
  v1::RecordingFile delete_recording(const v1::DeleteRecordingRequest& request);
  /// Has the flight recorder keep this moment: 20 s before, 2 s after. Returns at once. Refused: WRONG_STATE
  /// (it is off).
  void make_incident(const std::string& reason);

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace hapticd::client
