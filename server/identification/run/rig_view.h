#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "hal/rig.h"
#include "rt/record/observation.h"
#include "server/identification/estimate/contact/press_frame.h"
#include "server/identification/run/identification_task.h"
#include "server/model/store/model_library.h"
#include "server/scene/scene_models.h"

namespace hapticd::server {

/// View of the live rig for an identification: with the tool's mass and the sensor's seat as they were
/// identified before, the sensor's zero followed, and the press and the line turned to where it expects them.
class RigView {
 public:
  /// Makes a view. `geometry`: usable.
  RigView(const IdentificationTask& task, const identification::PressGeometry& geometry,
          const hal::RigInfo& rig, const RigModels& models, const ZeroInForce& zero);

  /// Properties of the rig with the mass of the tool that is used.
  const hal::RigInfo& rig_info() const { return rig_; }
  /// Converts each observation, in order.
  rt::Observation see(const rt::Observation& observation) noexcept;
  /// Models of the rig that are used, in words; empty if none is.
  const std::string& remark() const { return remark_; }

 private:
  enum class Needs : std::uint8_t {
    kRaw,      ///< what it finds is the tool and the sensor itself, or it goes by the encoders
    kSeated,   ///< the tool as it is held, without what the sensor adds
    kUpright,  ///< a press along -z with an upright tool
  };
  static Needs needs_of(const IdentificationTask& task) noexcept;

  Needs needs_;
  hal::RigInfo rig_;
  std::string remark_;
  std::optional<identification::PressFrame> frame_;
};

}  // namespace hapticd::server
