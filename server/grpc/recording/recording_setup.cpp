#include "server/grpc/recording/recording_setup.h"

#include <unistd.h>

#include <array>
#include <string>

#include "hal/recording/recording_names.h"
#include "server/config/config.h"
#include "server/grpc/messages/telemetry_columns.h"
#include "server/grpc/recording/recording_messages.h"
#include "server/process/system_clock.h"
#include "server/process/version.h"
#include "server/scene/scene_host.h"
#include "server/session/session.h"

namespace hapticd::server {

namespace {

/// Turns the loaded scene into metadata of a recording.
recording::Texts texts_of(const ResolvedScene* scene) {
  if (scene == nullptr) return {{"name", ""}};
  std::string hashes;
  for (const std::string& hash : scene->stored) hashes += (hashes.empty() ? "" : " ") + hash;
  return {{"name", scene->spec.name},
          {"toml", scene->written},
          {"object_model", scene->model ? scene->model->model.name : ""},
          {"stored_models", hashes}};
}

}  // namespace

recording::EventKind kind_of_call(std::string_view method) {
  using enum recording::EventKind;
  if (method == "SafetyService/Stop") return kStop;
  if (method == "RenderingService/SetTarget") return kTarget;
  if (method.starts_with("SceneService/")) return kScene;
  if (method.starts_with("LeaseService/")) return kLease;
  if (method.starts_with("TurntableService/")) return kTurntable;
  if (method.starts_with("RecordingService/")) return kRecording;
  if (method.starts_with("IdentificationService/") || method.starts_with("CalibrationService/"))
    return kIdentification;
  if (method == "RigService/BiasForceSensor" || method == "RigService/HomeDevice") return kSensor;
  return kCommand;
}

RecordingSources sources_of(const DaemonConfig& config, const Session& session, const SceneHost& scenes) {
  const hal::RigInfo& rig = session.rig_info();
  RecordingSources sources;
  sources.columns = telemetry_columns();
  sources.channels = rig.has_truth ? ~0U : ~rt::channel::kTruth;
  sources.rate_hz = config.loop.rate_hz;
  sources.block_schema = schema_of(recording::kBlockSchema);
  sources.event_schema = schema_of(recording::kEventSchema);
  sources.configuration = write_config(config);
  std::array<char, 256> host{};
  gethostname(host.data(), host.size() - 1);
  sources.rig = {{"hapticd", std::string(version())}, {"host", host.data()},        {"rig", rig.name},
                 {"device", rig.device.model},        {"sensor", rig.sensor.model}, {"boot", boot_name()}};
  sources.scene = [&scenes] { return texts_of(scenes.current().get()); };
  sources.rig_time_ns = [&session] { return session.now_ns(); };
  return sources;
}

}  // namespace hapticd::server
