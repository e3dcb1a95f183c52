#pragma once

#include <memory>
#include <string>
#include <variant>

#include "hal/error.h"
#include "server/identification/estimate/contact/press_frame.h"
#include "server/identification/run/recorded_observations.h"
#include "server/identification/session/identification.h"
#include "server/identification/session/tasks.h"
#include "server/session/outcome.h"

namespace hapticd::server {

/// What to identify.
using IdentificationTask =
    std::variant<identification::ContactTask, identification::FrictionTask,
                 identification::StructuralStiffnessTask, identification::ToolTask,
                 identification::ThresholdTask, identification::GainsTask, identification::InclusionTask>;

/// Name of a kind: "contact", "friction", "structural_stiffness", "tool", "threshold", "gains" or
/// "inclusion".
const char* kind_name(const IdentificationTask& task) noexcept;

/// Time after which it ends if no limit is asked for, s of the rig's time: about twice what a person on real
/// parts takes.
double default_time_limit_s(const IdentificationTask& task) noexcept;

/// True if an object is touched, and the model is the object's.
bool is_about_object(const IdentificationTask& task) noexcept;

/// Columns with which a recording for this task is to be read; none if only a rig will do.
std::optional<RecordedMotion> recorded_motion(const IdentificationTask& task) noexcept;

/// Checks that numbers are in their ranges; the error names the field.
std::optional<Refusal> check(const IdentificationTask& task);

/// Checks what the rig lacks for it, if anything: force sensor, device, outside instrument, a simulated hand
/// or a user.
std::optional<Refusal> check_rig(const IdentificationTask& task, const hal::RigInfo& rig);

/// True if it listens to the force sensor at all.
bool uses_sensor(const IdentificationTask& task) noexcept;

/// True if it listens to an instrument that measures the tip from outside.
bool uses_instrument(const IdentificationTask& task) noexcept;

/// True if the device renders meanwhile; otherwise a latched guard does not matter.
bool renders_force(const IdentificationTask& task) noexcept;

/// True if what the sensor reads at rest has to be zero; otherwise it is found as well.
bool needs_bias(const IdentificationTask& task) noexcept;

/// Checks the place of the object and the direction of the strokes. The simulated hand knows one press only,
/// along -z.
std::optional<Refusal> check_geometry(const identification::PressGeometry& geometry, bool hand_is_simulated);

std::unique_ptr<identification::Identification> make_identification(const IdentificationTask& task,
                                                                    const hal::RigInfo& rig);

}  // namespace hapticd::server
