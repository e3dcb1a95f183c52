#pragma once

#include <array>
#include <string_view>

#include "server/config/access_config.h"

namespace hapticd::server {

/// What one call needs.
struct AccessRow {
  std::string_view method;  ///< "RigService/GetRigInfo"
  Role role;                ///< at least
  bool needs_lease;         ///< by the rule below
  bool is_audited;          ///< written to the audit log also if it was granted
};

namespace access_table_detail {
inline constexpr bool kLease = true;
inline constexpr bool kNoLease = false;
inline constexpr bool kAudited = true;
inline constexpr bool kUnaudited = false;
}  // namespace access_table_detail

// clang-format off
/// Every call of the contract; a call that is not here is refused. All who are identified may stop.
///
/// A call needs the lease if it changes what the holder feels, measures or keeps: it commands the rig, begins
/// or ends what runs only once (a recording, an identification, a calibration), or changes what the next
/// scene of the holder uses (tags of models, the calibration that is adopted). It needs none if it only
/// looks, adds something new (an upload, an import, a note, an incident, poses of a tracker), removes what
/// nothing uses, or takes force away.
inline constexpr auto kAccessTable = [] {
  using namespace access_table_detail;
  using enum Role;
  return std::array{
    AccessRow{"AccessService/GetAccess",                    kNone,       kNoLease, kUnaudited},
    AccessRow{"AccessService/OpenConsole",                  kObserver,   kNoLease, kAudited},
    AccessRow{"AccessService/ReportConsole",                kConsole,    kNoLease, kUnaudited},
    AccessRow{"AccessService/RedeemConsoleKey",             kConsole,    kNoLease, kUnaudited},
    AccessRow{"LeaseService/AcquireLease",                  kOperator,   kNoLease, kAudited},
    AccessRow{"LeaseService/TakeLease",                     kOperator,   kNoLease, kAudited},
    AccessRow{"LeaseService/RenewLease",                    kOperator,   kNoLease, kUnaudited},
    AccessRow{"LeaseService/ReturnLease",                   kOperator,   kNoLease, kAudited},
    AccessRow{"LeaseService/GetLease",                      kObserver,   kNoLease, kUnaudited},
    AccessRow{"LeaseService/WatchLease",                    kObserver,   kNoLease, kUnaudited},
    AccessRow{"WatchdogService/CheckIn",                    kOperator,   kNoLease, kUnaudited},
    AccessRow{"WatchdogService/GetWatchdog",                kObserver,   kNoLease, kUnaudited},
    AccessRow{"ClockService/Exchange",                      kObserver,   kNoLease, kUnaudited},
    AccessRow{"ClockService/GetClock",                      kObserver,   kNoLease, kUnaudited},
    AccessRow{"RigService/GetRigInfo",                      kObserver,   kNoLease, kUnaudited},
    AccessRow{"RigService/GetRigState",                     kObserver,   kNoLease, kUnaudited},
    AccessRow{"RigService/Diagnose",                        kObserver,   kNoLease, kUnaudited},
    AccessRow{"RigService/BiasForceSensor",                 kOperator,   kLease,   kAudited},
    AccessRow{"RigService/HomeDevice",                      kOperator,   kLease,   kAudited},
    AccessRow{"EventService/ListEvents",                    kObserver,   kNoLease, kUnaudited},
    AccessRow{"EventService/WatchEvents",                   kObserver,   kNoLease, kUnaudited},
    AccessRow{"SceneService/ListScenes",                    kObserver,   kNoLease, kUnaudited},
    AccessRow{"SceneService/ExplainScene",                  kObserver,   kNoLease, kUnaudited},
    AccessRow{"SceneService/LoadScene",                     kOperator,   kLease,   kAudited},
    AccessRow{"SceneService/UnloadScene",                   kOperator,   kLease,   kAudited},
    AccessRow{"RenderingService/SetTarget",                 kOperator,   kLease,   kAudited},
    AccessRow{"RenderingService/GetFeasibleRange",          kObserver,   kNoLease, kUnaudited},
    AccessRow{"SafetyService/Stop",                         kNone,       kNoLease, kAudited},
    AccessRow{"SafetyService/Clear",                        kOperator,   kLease,   kAudited},
    AccessRow{"SafetyService/ListFaults",                   kObserver,   kNoLease, kUnaudited},
    AccessRow{"TelemetryService/Subscribe",                 kObserver,   kNoLease, kUnaudited},
    AccessRow{"PoseService/Subscribe",                      kObserver,   kNoLease, kUnaudited},
    AccessRow{"RecordingService/StartRecording",            kOperator,   kLease,   kAudited},
    AccessRow{"RecordingService/StopRecording",             kOperator,   kLease,   kAudited},
    AccessRow{"RecordingService/Annotate",                  kOperator,   kNoLease, kAudited},
    AccessRow{"RecordingService/ListRecordings",            kObserver,   kNoLease, kUnaudited},
    AccessRow{"RecordingService/GetRecording",              kObserver,   kNoLease, kUnaudited},
    AccessRow{"RecordingService/ExportRecording",           kObserver,   kNoLease, kUnaudited},
    AccessRow{"RecordingService/DeleteRecording",           kMaintainer, kNoLease, kAudited},
    AccessRow{"RecordingService/MakeIncident",              kOperator,   kNoLease, kAudited},
    AccessRow{"SimulationService/GetSimulation",            kObserver,   kNoLease, kUnaudited},
    AccessRow{"SimulationService/SetHandProgram",           kOperator,   kLease,   kAudited},
    AccessRow{"SimulationService/SetObject",                kOperator,   kLease,   kAudited},
    AccessRow{"TurntableService/GetTurntable",              kObserver,   kNoLease, kUnaudited},
    AccessRow{"TurntableService/Home",                      kOperator,   kLease,   kAudited},
    AccessRow{"TurntableService/MoveTo",                    kOperator,   kLease,   kAudited},
    AccessRow{"TurntableService/StopTurntable",             kNone,       kNoLease, kAudited},
    AccessRow{"TurntableService/ClearAlarm",                kOperator,   kLease,   kAudited},
    AccessRow{"TurntableService/Engage",                    kOperator,   kLease,   kAudited},
    AccessRow{"TurntableService/Disengage",                 kOperator,   kLease,   kAudited},
    AccessRow{"GuideService/MoveTool",                      kOperator,   kLease,   kAudited},
    AccessRow{"PresentationService/BeginPresentation",      kOperator,   kLease,   kAudited},
    AccessRow{"PresentationService/EndPresentation",        kOperator,   kLease,   kAudited},
    AccessRow{"ExperimentService/ReportExperiment",         kOperator,   kNoLease, kUnaudited},
    AccessRow{"ExperimentService/GetExperiment",            kObserver,   kNoLease, kUnaudited},
    AccessRow{"IdentificationService/StartIdentification",  kOperator,   kLease,   kAudited},
    AccessRow{"IdentificationService/WatchIdentification",  kObserver,   kNoLease, kUnaudited},
    AccessRow{"IdentificationService/CancelIdentification", kOperator,   kLease,   kAudited},
    AccessRow{"IdentificationService/ListIdentifications",  kObserver,   kNoLease, kUnaudited},
    AccessRow{"IdentificationService/UploadRecording",      kOperator,   kNoLease, kAudited},
    AccessRow{"CalibrationService/StartCalibration",        kOperator,   kLease,   kAudited},
    AccessRow{"CalibrationService/PushReferencePoses",      kOperator,   kNoLease, kUnaudited},
    AccessRow{"CalibrationService/FinishCalibration",       kOperator,   kLease,   kAudited},
    AccessRow{"CalibrationService/WatchCalibration",        kObserver,   kNoLease, kUnaudited},
    AccessRow{"CalibrationService/CancelCalibration",       kOperator,   kLease,   kAudited},
    AccessRow{"CalibrationService/ListCalibrations",        kObserver,   kNoLease, kUnaudited},
    AccessRow{"CalibrationService/GetCalibration",          kObserver,   kNoLease, kUnaudited},
    AccessRow{"CalibrationService/AdoptCalibration",        kOperator,   kLease,   kAudited},
    AccessRow{"CalibrationService/DeleteCalibration",       kMaintainer, kNoLease, kAudited},
    AccessRow{"ModelService/ListModels",                    kObserver,   kNoLease, kUnaudited},
    AccessRow{"ModelService/GetModel",                      kObserver,   kNoLease, kUnaudited},
    AccessRow{"ModelService/ListStoredModels",              kObserver,   kNoLease, kUnaudited},
    AccessRow{"ModelService/GetStoredModel",                kObserver,   kNoLease, kUnaudited},
    AccessRow{"ModelService/DiffStoredModels",              kObserver,   kNoLease, kUnaudited},
    AccessRow{"ModelService/ExportStoredModel",             kObserver,   kNoLease, kUnaudited},
    AccessRow{"ModelService/TagStoredModel",                kOperator,   kLease,   kAudited},
    AccessRow{"ModelService/UntagStoredModel",              kOperator,   kLease,   kAudited},
    AccessRow{"ModelService/DeleteStoredModel",             kMaintainer, kLease,   kAudited},
    AccessRow{"ModelService/ImportStoredModel",             kMaintainer, kNoLease, kAudited},
  };
}();
// clang-format on

/// Row of "RigService/GetRigInfo"; nullptr if there is none.
const AccessRow* find_access_row(std::string_view method);

}  // namespace hapticd::server
