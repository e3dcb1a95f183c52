#pragma once

#include <atomic>
#include <optional>

#include "server/identification/run/identification_runner.h"
#include "server/identification/run/recording_store.h"
#include "server/model/store/model_library.h"
#include "server/session/outcome.h"

namespace hapticd::server {

/// Fills in what the request's reference_recording or reference_model say of the object without its
/// inclusion. Refuses both together, a reference for another kind, a name or recording that is not there, a
/// recording without presses, and a known depth without a reference. Ends soon after `given_up` is set.
std::optional<Refusal> fill_reference(IdentificationRequest& request, const RecordingStore& recordings,
                                      const ModelLibrary& models, const std::atomic<bool>& given_up);

}  // namespace hapticd::server
