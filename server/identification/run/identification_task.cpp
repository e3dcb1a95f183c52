#include "server/identification/run/identification_task.h"

#include <array>
#include <cmath>

#include "rt/signal/vector.h"
#include "server/identification/session/contact/contact_identification.h"
#include "server/identification/session/friction_identification.h"
#include "server/identification/session/gains_identification.h"
#include "server/identification/session/inclusion/inclusion_identification.h"
#include "server/identification/session/structural_identification.h"
#include "server/identification/session/threshold_identification.h"
#include "server/identification/session/tool_identification.h"
#include "server/text/range.h"

namespace hapticd::server {

namespace {

template <class... Cases>
struct Overloaded : Cases... {
  using Cases::operator()...;
};
template <class... Cases>
Overloaded(Cases...) -> Overloaded<Cases...>;

/// True if the tip as an instrument from outside sees it is compared with the encoders: the force sensor does
/// not matter.
bool is_by_instrument(const IdentificationTask& task) noexcept {
  const auto* structure = std::get_if<identification::StructuralStiffnessTask>(&task);
  return structure != nullptr && !structure->rigid_contact;
}

/// Finds the first number that is out of its range.
class FieldCheck {
 public:
  void range(double value, const Range& range, const char* what, const char* field) {
    if (refusal) return;
    if (auto error = server::check(value, range, what, std::string("StartIdentificationRequest.") + field)) {
      refusal =
          Refusal{std::isfinite(value) ? RefusalKind::kOutOfRange : RefusalKind::kInvalidArgument, *error};
    }
  }
  std::optional<Refusal> refusal;
};

}  // namespace

const char* kind_name(const IdentificationTask& task) noexcept {
  constexpr std::array kNames{"contact", "friction", "structural_stiffness", "tool", "threshold",
                              "gains",   "inclusion"};
  return kNames[task.index()];
}

double default_time_limit_s(const IdentificationTask& task) noexcept {
  constexpr std::array kLimitsS{120.0, 120.0, 300.0, 60.0, 180.0, 120.0, 600.0};  // as the names above
  return kLimitsS[task.index()];
}

bool is_about_object(const IdentificationTask& task) noexcept {
  return std::holds_alternative<identification::ContactTask>(task) ||
         std::holds_alternative<identification::FrictionTask>(task) ||
         std::holds_alternative<identification::InclusionTask>(task);
}

std::optional<RecordedMotion> recorded_motion(const IdentificationTask& task) noexcept {
  if (std::holds_alternative<identification::ContactTask>(task)) return RecordedMotion::kPress;
  if (std::holds_alternative<identification::FrictionTask>(task)) return RecordedMotion::kStroke;
  if (std::holds_alternative<identification::InclusionTask>(task)) return RecordedMotion::kScan;
  if (std::holds_alternative<identification::ToolTask>(task) ||
      std::holds_alternative<identification::ThresholdTask>(task)) {
    return RecordedMotion::kFree;
  }
  if (const auto* structure = std::get_if<identification::StructuralStiffnessTask>(&task)) {
    return structure->rigid_contact ? RecordedMotion::kRigid : RecordedMotion::kBend;
  }
  return std::nullopt;
}

std::optional<Refusal> check(const IdentificationTask& task) {
  FieldCheck fields;
  std::visit(
      Overloaded{
          [&](const identification::ContactTask& t) {
            fields.range(t.force_n, {0.2, 30.0, "N"}, "force", "contact.force_n");
            fields.range(t.displacement_mm, {0.0, 100.0, "mm"}, "displacement", "contact.displacement_mm");
            fields.range(t.speed_mm_per_s, {0.0, 1000.0, "mm/s"}, "speed", "contact.speed_mm_per_s");
          },
          [&](const identification::FrictionTask& t) {
            fields.range(t.length_mm, {5.0, 200.0, "mm"}, "length", "friction.length_mm");
            fields.range(t.normal_force_n, {0.0, 1000.0, "N"}, "normal force", "recording.normal_force_n");
          },
          [&](const identification::StructuralStiffnessTask& t) {
            fields.range(t.least_object_stiffness_n_per_mm, {10.0, 1e6, "N/mm"},
                         "least stiffness of the object",
                         "structural_stiffness.least_object_stiffness_n_per_mm");
          },
          [](const identification::ToolTask&) {},
          [&](const identification::ThresholdTask& t) {
            fields.range(t.duration_s, {5.0, 600.0, "s"}, "duration", "threshold.duration_s");
          },
          [&](const identification::GainsTask& t) {
            fields.range(t.target_stiffness_n_per_mm, {0.05, 20.0, "N/mm"}, "target stiffness",
                         "gains.target_stiffness_n_per_mm");
          },
          [&](const identification::InclusionTask& t) {
            fields.range(t.reach_mm, {10.0, 100.0, "mm"}, "reach", "inclusion.reach_mm");
            fields.range(t.spacing_mm, {3.0, 30.0, "mm"}, "spacing", "inclusion.spacing_mm");
            fields.range(t.displacement_mm, {3.0, 50.0, "mm"}, "displacement", "inclusion.displacement_mm");
            fields.range(t.known_depth_mm, {0.0, 100.0, "mm"}, "known depth", "inclusion.known_depth_mm");
            fields.range(t.tip_radius_mm.value_or(0.0), {0.0, 20.0, "mm"}, "tip radius",
                         "inclusion.tip_radius_mm");
          }},
      task);
  return fields.refusal;
}

std::optional<Refusal> check_rig(const IdentificationTask& task, const hal::RigInfo& rig) {
  const auto lacks = [&](const std::string& what, const std::string& remedy) {
    return Refusal{RefusalKind::kFailedPrecondition,
                   {"the rig has " + what, "rig '" + rig.name + "'", kind_name(task), "", remedy},
                   Reason::kNoHardware};
  };
  const bool by_instrument = is_by_instrument(task);
  if (!by_instrument && rig.sensor.model.empty()) {
    return lacks("no force sensor", "identify on a recording, or on a rig that has one");
  }
  if (rig.kind == hal::RigKind::kReplay) {
    return lacks("no hand that could touch anything", "upload the recording and identify from it");
  }
  if (by_instrument && !rig.has_external_position) {
    return lacks(
        "no instrument that measures the tip from outside",
        "mount one (an LVDT, a dial gauge, a laser) on an input of the analog board and name it in the rig "
        "file ([rig] instrument = \"board\", [rig.board_instrument]); or press on something rigid (--rigid); "
        "or record it with encoders and the device's force, and identify from the recording");
  }
  return std::nullopt;
}

bool uses_sensor(const IdentificationTask& task) noexcept {
  return !is_by_instrument(task);
}

bool uses_instrument(const IdentificationTask& task) noexcept {
  return is_by_instrument(task);
}

bool renders_force(const IdentificationTask& task) noexcept {
  return std::holds_alternative<identification::StructuralStiffnessTask>(task) ||
         std::holds_alternative<identification::GainsTask>(task);
}

bool needs_bias(const IdentificationTask& task) noexcept {
  return uses_sensor(task) && !std::holds_alternative<identification::ToolTask>(task);
}

std::optional<Refusal> check_geometry(const identification::PressGeometry& geometry, bool hand_is_simulated) {
  constexpr const char* kPlace = "StartIdentificationRequest.press_direction, line_direction";
  if (!identification::is_usable(geometry)) {
    return Refusal{RefusalKind::kInvalidArgument,
                   {"the directions are not usable", kPlace, "",
                    "finite, longer than 0, more than 10° between them", "leave them out for -z and x"}};
  }
  const identification::PressGeometry usual;
  const bool is_usual = rt::norm(geometry.press_direction - usual.press_direction) == 0.0 &&
                        rt::norm(geometry.line_direction - usual.line_direction) == 0.0;
  if (hand_is_simulated && !is_usual) {
    return Refusal{RefusalKind::kInvalidArgument,
                   {"the simulated hand presses along -z and strokes along x", kPlace, "", "",
                    "leave them out, or identify on a rig that a person holds"}};
  }
  return std::nullopt;
}

std::unique_ptr<identification::Identification> make_identification(const IdentificationTask& task,
                                                                    const hal::RigInfo& rig) {
  using Made = std::unique_ptr<identification::Identification>;
  return std::visit(Overloaded{[&](const identification::ContactTask& t) -> Made {
                                 return std::make_unique<identification::ContactIdentification>(t, rig);
                               },
                               [&](const identification::FrictionTask& t) -> Made {
                                 return std::make_unique<identification::FrictionIdentification>(t, rig);
                               },
                               [&](const identification::StructuralStiffnessTask& t) -> Made {
                                 return std::make_unique<identification::StructuralIdentification>(t, rig);
                               },
                               [&](const identification::ToolTask& t) -> Made {
                                 return std::make_unique<identification::ToolIdentification>(t, rig);
                               },
                               [&](const identification::ThresholdTask& t) -> Made {
                                 return std::make_unique<identification::ThresholdIdentification>(t, rig);
                               },
                               [&](const identification::GainsTask& t) -> Made {
                                 return std::make_unique<identification::GainsIdentification>(t, rig);
                               },
                               [&](const identification::InclusionTask& t) -> Made {
                                 return std::make_unique<identification::InclusionIdentification>(t, rig);
                               }},
                    task);
}

}  // namespace hapticd::server
