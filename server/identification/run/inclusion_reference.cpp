#include "server/identification/run/inclusion_reference.h"

#include <fmt/format.h>

#include <utility>

#include "server/identification/run/recorded_observations.h"
#include "server/identification/session/inclusion/press_collector.h"

namespace hapticd::server {

namespace {

constexpr const char* kRecording = "StartIdentificationRequest.inclusion.reference_recording";
constexpr const char* kModel = "StartIdentificationRequest.inclusion.reference_model";

std::optional<Refusal> read_presses(const std::string& id, const RecordingStore& recordings,
                                    const std::atomic<bool>& given_up, identification::InclusionTask& task) {
  auto recording = recordings.find(id);
  if (!recording) return recording.refusal();
  const auto rows = RecordedObservations::open((*recording)->file.path(), RecordedMotion::kScan,
                                               (*recording)->description, {0.0, 0.0, -1.0}, &given_up);
  if (!rows) return Refusal{RefusalKind::kInvalidArgument, rows.error()};
  identification::PressCollector collector(rows->rig_info(), task.threshold_n);
  if (auto error = rows->read([&](const rt::Observation& observation) {
        collector.add(observation);
        return !given_up.load();
      })) {
    return Refusal{RefusalKind::kInvalidArgument, std::move(*error)};
  }
  collector.end();
  if (collector.presses().empty()) {
    return Refusal{
        RefusalKind::kInvalidArgument,
        {"the recording without the inclusion has no press", kRecording, (*recording)->description.name,
         "2 mm deep and with 0.1 N or more, the tool free in between",
         "bias the sensor, press the object without the inclusion, and record again"}};
  }
  task.reference.presses = collector.presses();
  task.reference.words = fmt::format("recording '{}', sha256 {}, {} presses", (*recording)->description.name,
                                     (*recording)->sha256, collector.presses().size());
  return std::nullopt;
}

std::optional<Refusal> take_law(const std::string& name, const ModelLibrary& models,
                                identification::InclusionTask& task) {
  const auto found = models.find_parts(name);
  if (!found) return found.refusal();
  if (!found->model.hunt_crossley) {
    return Refusal{RefusalKind::kInvalidArgument,
                   {"the model has no Hunt-Crossley law", kModel, name, "",
                    "identify its contact with '--law hunt_crossley', or give a recording instead"}};
  }
  task.reference.law = found->model.hunt_crossley->parameters;
  const StoredModel* stored = found->hunt_crossley.get();
  task.reference.words = fmt::format("the law of '{}'{}", name,
                                     stored != nullptr ? ", stored model " + stored->short_hash() : "");
  return std::nullopt;
}

}  // namespace

std::optional<Refusal> fill_reference(IdentificationRequest& request, const RecordingStore& recordings,
                                      const ModelLibrary& models, const std::atomic<bool>& given_up) {
  auto* task = std::get_if<identification::InclusionTask>(&request.task);
  if (task == nullptr) return std::nullopt;
  if (!request.reference_recording.empty() && !request.reference_model.empty()) {
    return Refusal{RefusalKind::kInvalidArgument,
                   {"two references of the object without its inclusion", kModel, request.reference_model,
                    "a recording or a model", "leave one of them out"}};
  }
  if (!request.reference_recording.empty()) {
    if (auto refusal = read_presses(request.reference_recording, recordings, given_up, *task)) return refusal;
  } else if (!request.reference_model.empty()) {
    if (auto refusal = take_law(request.reference_model, models, *task)) return refusal;
  }
  if (task->known_depth_mm > 0.0 && !task->reference.is_there()) {
    return Refusal{
        RefusalKind::kInvalidArgument,
        {"presses straight over an inclusion do not show what the object is without it",
         "StartIdentificationRequest.inclusion.known_depth_mm", fmt::format("{} mm", task->known_depth_mm),
         "with reference_recording or reference_model", "give one of them, or scan the object"}};
  }
  return std::nullopt;
}

}  // namespace hapticd::server
